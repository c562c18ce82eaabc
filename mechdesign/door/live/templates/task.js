ready(() => {
  const REST = 400; // milliseconds after which a hand rests: a search takes longer than a motion
  const RING = 12, TURN = 8, ARM = 36; // radii of the rings of a point and of a body's angle, and how far this is away
  const TAKE = "moving-grid";

  const state = document.querySelector(".live-state"), room = document.querySelector(".live-answer"), stage = document.querySelector(".live-stage");
  const own = openHand(() => { place(); soon(); }), {about} = own;
  const alone = document.querySelector(".live-alone"), button = document.querySelector("[data-do=alone]");
  let turn = 0, timer = 0, asking = null, search = "", tiles = [], drawing = stage.querySelector("svg"), at = about.sheet, rings = [];

  // The task alone, where its points lie close together beside a linkage.
  button?.addEventListener("click", () => {
    alone.hidden = !alone.hidden;
    stage.hidden = !alone.hidden;
    button.setAttribute("aria-pressed", stage.hidden);
    look();
  });

  // Rings stand in the drawing that is seen.
  function look() {
    const {moving} = stage.querySelector("figure") || {};
    if (moving && stage.hidden) moving.stop();
    for (const ring of document.querySelectorAll(".live-rings")) ring.remove();
    drawing = stage.hidden ? alone.querySelector("svg") : moving ? moving.drawing : stage.querySelector("svg");
    at = stage.hidden || !moving ? about.sheet : moving.sheet();
    handle();
  }

  // The search runs when the hand rests; an older one is dropped.
  function soon() {
    if (asking) asking.abort();
    room.setAttribute("aria-busy", "true");
    clearTimeout(timer);
    if (!own.held) timer = setTimeout(ask, REST);
  }

  async function ask() {
    const mine = asking = new AbortController(), stop = own.clock(state);
    state.textContent = "\u2026";
    try {
      const answer = await own.post("answer", {turn: ++turn}, mine.signal);
      if (mine.signal.aborted || answer.overtaken) return;
      own.answered(room, answer, show);
    } catch (error) {
      if (error.name !== "AbortError") own.lost(error);
    } finally {
      stop();
    }
  }

  function show(answer) {
    const before = stage.querySelector("figure"), still = before && !before.moving.playing();
    own.set = answer.set;
    own.fill();
    search = answer.search;
    tiles = answer.tiles;
    document.querySelector("#task ul").replaceChildren(...answer.words.map(textContent => html("li", {textContent})));
    own.colour("linkages", answer.dark);
    room.innerHTML = answer.html;
    if (!answer.stage.trim()) return;
    stage.innerHTML = answer.stage;
    const figure = stage.querySelector("figure");
    figure.dispatchEvent(new Event("moving-new", {bubbles: true}));
    if (still) figure.moving.stop();
    for (const [k, tile] of [...room.querySelectorAll(`.${TAKE} button`)].entries()) {
      if (own.left(tiles[k][1])) tile.append(html("span", {className: "live-changed", textContent: "changed"}));
    }
    figure.addEventListener("moving-chosen", () => { if (!stage.hidden) { at = figure.moving.sheet(); place(); } });
    look();
  }

  // A click takes a linkage over, before the report's own click enlarges it.
  room.addEventListener("click", async event => {
    const tile = event.target.closest(`.${TAKE} button`);
    if (!tile) return;
    event.stopPropagation();
    try {
      const answer = await own.post("take", {search, row: tiles[[...tile.parentNode.children].indexOf(tile)][0]});
      if (answer.wrong) own.warn(answer.wrong); else location.assign(answer.to);
    } catch (error) { own.lost(error); }
  }, true);

  // Rings at the points of the task, and beside those of a body at its angle.
  function handle() {
    if (!drawing) return;
    const parent = make("g", {class: "live-rings"}, drawing);
    drawing.setAttribute("role", "group");
    rings = about.handles.flatMap(({label, names}) => {
      const [x, y, angle] = names;
      const ring = hold(parent, label, RING, [x, y], ([px, py], across, down) => own.snapped([px + across, py + down]));
      make("circle", {r: 2.5, class: "live-dot"}, ring);
      const placed = [[ring, () => [own.value(x), own.value(y), 0, 0]]];
      if (angle) {
        const toward = () => own.value(angle) * about.turn;
        const other = hold(parent, `angle of ${label}`, TURN, [angle], ([value], across, down) => {
          const away = ARM / at[2], to = Math.atan2(away * Math.sin(value * about.turn) + down, away * Math.cos(value * about.turn) + across);
          const step = 2 * Math.PI / about.turn, moved = to / about.turn;
          return [moved - step * Math.round((moved - value) / step)];
        }, true);
        other.classList.add("live-turn");
        placed.push([other, () => [own.value(x), own.value(y), ARM * Math.cos(toward()), -ARM * Math.sin(toward())]]);
      }
      return placed;
    });
    place();
  }

  function place() {
    for (const [ring, where] of rings) {
      const [x, y, across, down] = where();
      ring.setAttribute("transform", `translate(${((x - at[0]) * at[2] + across).toFixed(2)} ${((at[1] - y) * at[2] + down).toFixed(2)})`);
    }
  }

  // Without digits that nobody sees: of a length a tenth of a unit of the drawing.
  const rounded = (value, scale) => Number(value.toFixed(Math.max(0, 1 + Math.ceil(Math.log10(scale)))));

  // A hand, or the arrow keys, change some numbers of the task by how far they go, in its lengths.
  function hold(parent, label, radius, names, changed, turning) {
    const set = (from, across, down) => {
      const now = changed(from, across, down).map(value => rounded(value, turning ? 1 : at[2]));
      own.put(Object.fromEntries(names.map((name, k) => [name, now[k]])));
      own.fill();
      place();
      own.beside(`${label}: ${now.join(", ")}`, false);
    };
    const take = (event, ring) => {
      const from = names.map(own.value);
      own.grasp(event, ring, (across, down) => {
        const scale = at[2] * own.pixels(drawing);
        set(from, across / scale, -down / scale);
        soon();
      }, () => { own.held = false; soon(); });
    };
    const press = (event, ring, way) => {
      const {before} = own.presses(ring), from = names.map(own.value);
      if (turning) {
        const step = Math.PI / 180 / about.turn * (event.shiftKey ? 10 : 1) * (way[0] < 0 || way[1] > 0 ? 1 : -1);
        own.put({[names[0]]: Number((from[0] + step).toPrecision(10))});
        own.fill();
        place();
      } else set(from, ...way.map(part => part * own.step(event)));
      own.remember(before);
      soon();
    };
    return own.ring(parent, label, radius, take, press);
  }

  handle();
  own.begin();
  ask();
});
