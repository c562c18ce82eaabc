/* What a compiler makes of the same work where a program knows one mechanism only: closed forms in loops over doubles.
   docs/benchmarks.py compiles it with cc and calls it. Lengths and angles are those of the studies there. */
#include <math.h>
#include <stdint.h>

#define BLOCK 512  /* samples at a time: their random numbers stay in the cache */
#define LANES 8
static const double HALF_PI = 1.57079632679489661923;

/* One call of sine each, since sine and cosine of one angle become a call that compilers do not make vectors of. */
static inline double cosine(double angle) { return sin(angle + HALF_PI); }

/* Pins A and B of a four-bar O A B D, with O at zero and D at (d, 0), B to the left of the way from A to D. */
void four_bar(long poses, const double *theta, double *pins) {
  const double a = 1, b = 3.5, c = 3, d = 4;
  double *ax = pins, *ay = ax + poses, *bx = ay + poses, *by = bx + poses;
  for (long i = 0; i < poses; i++) {
    double x = a * cosine(theta[i]), y = a * sin(theta[i]), u = d - x, v = -y, square = u * u + v * v;
    double along = (square + b * b - c * c) / (2 * square), across = sqrt(b * b / square - along * along);
    ax[i] = x, ay[i] = y, bx[i] = x + along * u - across * v, by[i] = y + along * v + across * u;
  }
}

/* xoshiro256+ (Blackman and Vigna, 2018) in lanes, begun by splitmix64. */
typedef struct { uint64_t word[4][LANES]; } Generator;

static void begin(Generator *g, uint64_t seed) {
  for (int k = 0; k < 4; k++)
    for (int i = 0; i < LANES; i++) {
      uint64_t z = seed += 0x9e3779b97f4a7c15u;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u, z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
      g->word[k][i] = z ^ (z >> 31);
    }
}

static void fill(Generator *g, double *uniform, int count) {
  for (int k = 0; k < count; k += LANES)
    for (int i = 0; i < LANES; i++) {
      uint64_t *a = &g->word[0][i], *b = &g->word[1][i], *c = &g->word[2][i], *d = &g->word[3][i];
      union { uint64_t bits; double value; } number = {((*a + *d) >> 12) | 0x3ff0000000000000u};
      uint64_t shifted = *b << 17;
      *c ^= *a, *d ^= *b, *b ^= *c, *a ^= *d, *c ^= shifted, *d = (*d << 45) | (*d >> 19);
      uniform[k + i] = number.value - 1 + 0x1p-53;
    }
}

/* Made two-link arms whose tip is further than `limit` away along x or y: two lengths of normal laws, two pins in their
   clearances [S2, eqs. 2, 4, 13]. Each link acts as one of another length at another angle. */
long arm(long samples, uint64_t seed, double limit) {
  const double theta1 = HALF_PI / 3, theta2 = HALF_PI * 2 / 3, r1 = 10, r2 = 8, sigma = 0.01, clearance = 0.03;
  const double spread = 0.01 / 3, disc = 1 - exp(-4.5);
  const double x = r1 * cos(theta1) + r2 * cos(theta2), y = r1 * sin(theta1) + r2 * sin(theta2);
  Generator g;
  double u[8][BLOCK];
  long failures = 0;
  begin(&g, seed);
  for (long k = 0; k < samples / BLOCK; k++) {
    int failed = 0;
    fill(&g, u[0], 8 * BLOCK);
#pragma GCC ivdep
    for (int i = 0; i < BLOCK; i++) {
      double size = sigma * sqrt(-2 * log(u[0][i])), turn = 4 * HALF_PI * u[1][i];
      double l1 = r1 + size * cosine(turn), l2 = r2 + size * sin(turn);
      size = spread * sqrt(-2 * log(u[2][i])), turn = 4 * HALF_PI * u[3][i];
      double c1 = (clearance + size * cosine(turn)) / 3, c2 = (clearance + size * sin(turn)) / 3;
      c1 *= sqrt(-2 * log(1 - disc * u[4][i])), turn = 4 * HALF_PI * u[5][i];
      double x1 = l1 + c1 * cosine(turn), y1 = c1 * sin(turn);
      c2 *= sqrt(-2 * log(1 - disc * u[6][i])), turn = 4 * HALF_PI * u[7][i];
      double x2 = l2 + c2 * cosine(turn), y2 = c2 * sin(turn);
      double R1 = sqrt(x1 * x1 + y1 * y1), R2 = sqrt(x2 * x2 + y2 * y2);
      double at1 = theta1 + atan2(y1, x1), at2 = theta2 + atan2(y2, x2);
      double dx = R1 * cosine(at1) + R2 * cosine(at2) - x, dy = R1 * sin(at1) + R2 * sin(at2) - y;
      failed += fmax(fabs(dx), fabs(dy)) > limit;
    }
    failures += failed;
  }
  return failures;
}

/* GII, GRI and area of the 2-RRR of S1, R = 1, in the upper half plane: sums over half-lines from its middle at `angles`, and
   over `places` along each, from 0 at its first point in the region to 1 at its last, with the weights of a rule. */
typedef struct { int count; const double *at, *weight; } Rule;

static void region(double l_min, double a, Rule angles, Rule places, double *found) {
  const double l_max = l_min + 2, b = l_max - a;
  double dexterity = 0, resistivity = 0, area = 0;
  for (int k = 0; k < angles.count; k++) {
    double c = cos(angles.at[k]), s = sin(angles.at[k]), g = 0, h = 0, w = 0;
    /* The nearer pivot ends the region inside, the further one outside. */
    double from = fabs(c) + sqrt(l_min * l_min - s * s), to = sqrt(l_max * l_max - s * s) - fabs(c);
    double weight = angles.weight[k] * fmax(to - from, 0);
    for (int i = 0; i < places.count; i++) {
      double r = from + (to - from) * places.at[i], part = places.weight[i] * r, x = r * c, y = r * s;
      double X[2], Y[2], moment[2];
      for (int leg = 0; leg < 2; leg++) {
        double side = leg ? -1 : 1, u = x - side, square = u * u + y * y;
        double along = (square + a * a - b * b) / (2 * square);
        double across = -side * sqrt(fmax(a * a / square - along * along, 1e-30));
        double px = along * u - across * y, py = along * y + across * u;
        X[leg] = u - px, Y[leg] = y - py, moment[leg] = Y[leg] * px - X[leg] * py;
      }
      double determinant = X[0] * Y[1] - X[1] * Y[0], product = fabs(moment[0] * moment[1]);
      double rods[2] = {X[0] * X[0] + Y[0] * Y[0], X[1] * X[1] + Y[1] * Y[1]};
      double sum = rods[1] * moment[0] * moment[0] + rods[0] * moment[1] * moment[1];
      double ratios = sum / (fabs(determinant) * product + 1e-300); /* condition number and its inverse together */
      g += part * 2 / (ratios + sqrt(fmax(ratios * ratios - 4, 0)));
      h += part * fabs(determinant) / product;
      w += part;
    }
    dexterity += weight * g, resistivity += weight * h, area += weight * w;
  }
  found[0] = dexterity / area, found[1] = resistivity / area, found[2] = area;
}

void regions(int designs, const double *l_min, const double *l_a, Rule angles, Rule places, double *found) {
  for (int k = 0; k < designs; k++) region(l_min[k], l_a[k], angles, places, found + 3 * k);
}

typedef struct { double x, y; } Vector;
typedef struct { Vector force; double moment; } Load; /* the moment is about the joint to the side that bears it */

static inline Vector plus(Vector a, Vector b) { return (Vector){a.x + b.x, a.y + b.y}; }
static inline Vector minus(Vector a, Vector b) { return (Vector){a.x - b.x, a.y - b.y}; }
static inline Vector times(double s, Vector a) { return (Vector){s * a.x, s * a.y}; }
static inline Vector turned(Vector a) { return (Vector){-a.y, a.x}; } /* by a quarter */
static inline double cross(Vector a, Vector b) { return a.x * b.y - a.y * b.x; }

typedef struct { Vector at, velocity, acceleration; } Pin;
typedef struct { double rate, acceleration; Vector along; } Bar; /* along: from its first pin to its second */

/* The pin of two bars of lengths b and c on two pins, to the left of the way from the first to the second (side 1) or not. */
static inline Pin joined(Pin p, Pin q, double b, double c, double side, Bar *first, Bar *second) {
  Vector span = minus(q.at, p.at);
  double square = span.x * span.x + span.y * span.y, along = (square + b * b - c * c) / (2 * square);
  double across = side * sqrt(b * b / square - along * along);
  Pin pin = {plus(p.at, plus(times(along, span), times(across, turned(span))))};
  first->along = minus(pin.at, p.at), second->along = minus(pin.at, q.at);
  /* w1 i u1 - w2 i u2 = v, and the same of accelerations with the centripetal ones on the right. */
  Vector u1 = first->along, u2 = second->along, v = minus(q.velocity, p.velocity);
  double determinant = cross(u1, u2);
  first->rate = (u2.x * v.x + u2.y * v.y) / determinant, second->rate = (u1.x * v.x + u1.y * v.y) / determinant;
  double w1 = first->rate * first->rate, w2 = second->rate * second->rate;
  Vector a = plus(minus(q.acceleration, p.acceleration), minus(times(w1, u1), times(w2, u2)));
  first->acceleration = (u2.x * a.x + u2.y * a.y) / determinant;
  second->acceleration = (u1.x * a.x + u1.y * a.y) / determinant;
  pin.velocity = plus(p.velocity, times(first->rate, turned(u1)));
  pin.acceleration = plus(p.acceleration, minus(times(first->acceleration, turned(u1)), times(w1, u1)));
  return pin;
}

/* Weight and inertia of a bar with its centre of mass at `centre` from its first pin. */
static inline Load carried(Pin p, Bar bar, Vector centre, double mass, double inertia) {
  double w = bar.rate * bar.rate;
  Vector a = plus(p.acceleration, minus(times(bar.acceleration, turned(centre)), times(w, centre)));
  Load load = {{-mass * a.x, -mass * (a.y + 9.81)}};
  load.moment = cross(centre, load.force) - inertia * bar.acceleration;
  return load;
}

/* What the bars of a dyad press on one another: the force on the first at their pin. */
static inline Vector inner(Bar first, Bar second, Load one, Load two) {
  Vector u = first.along, v = second.along;
  return times(-1 / cross(u, v), plus(times(one.moment, v), times(two.moment, u)));
}

/* Effort and joint forces O A B D C F G of a Watt six-bar whose crank turns evenly at `rate`. */
void six_bar(long poses, const double *theta, double rate, double *effort, double *forces) {
  const Pin O = {{0, 0}}, D = {{4, 0}}, G = {{8, 0}};
  for (long i = 0; i < poses; i++) {
    Bar crank = {rate, 0, {cosine(theta[i]), sin(theta[i])}}, rod, rocker, link, last;
    Pin A = {crank.along, times(rate, turned(crank.along)), times(-rate * rate, crank.along)};
    joined(A, D, 3.5, 3, 1, &rod, &rocker);
    Vector arm = plus(times(3.2 / 3, rocker.along), times(0.4 / 3, turned(rocker.along)));
    Pin C = {plus(D.at, arm), times(rocker.rate, turned(arm))};
    C.acceleration = minus(times(rocker.acceleration, turned(arm)), times(rocker.rate * rocker.rate, arm));
    joined(C, G, 4, 3, 1, &link, &last);
    Load on_crank = carried(O, crank, times(0.5, crank.along), 1, 0.1), on_rod = carried(A, rod, times(0.5, rod.along), 2, 0.4);
    Vector middle = times(1. / 3, plus(rocker.along, arm));
    Load on_rocker = carried(D, rocker, middle, 2, 0.3), on_link = carried(C, link, times(0.5, link.along), 2, 0.5);
    Load on_last = carried(G, last, times(0.5, last.along), 1.5, 0.3);
    Vector at_F = inner(link, last, on_link, on_last), at_G = minus(at_F, on_last.force);
    Vector at_C = plus(on_link.force, at_F); /* on the rocker */
    on_rocker.force = plus(on_rocker.force, at_C), on_rocker.moment += cross(arm, at_C);
    Vector at_B = inner(rod, rocker, on_rod, on_rocker), at_D = minus(at_B, on_rocker.force);
    Vector at_A = plus(on_rod.force, at_B), at_O = times(-1, plus(on_crank.force, at_A));
    effort[i] = -on_crank.moment - cross(crank.along, at_A);
    Vector all[7] = {at_O, at_A, at_B, at_D, at_C, at_F, at_G};
    for (int k = 0; k < 7; k++) forces[2 * k * poses + i] = all[k].x, forces[(2 * k + 1) * poses + i] = all[k].y;
  }
}
