(() => {
  const PLACES = 20, TURNS = 100, TIMES = 10000, ROWS = 1000000; // integers in a unit, as the page writes them
  const SLOW_STEPS = 24, SLOW_PAUSE = 600; // of a motion that is wanted without motion: poses, and milliseconds each
  const FRONT_TIME = 5000; // milliseconds from end to end of the motion of a front's design
  const ROW_POSES = 60; // of a workspace, through which it goes in that time
  const NEAR = 0.005; // a motion passes a pose this near, as a part of the range of what it gives
  const calm = window.matchMedia("(prefers-reduced-motion: reduce)");

  const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

  // Steps in letters as values: digits to the base 32, the lowest first, all but the last 32 more; the sign in the
  // lowest bit; a point where there is no value. The last value stands to the end.
  function decode(text, count, unit) {
    const values = new Array(count);
    let last = 0, at = 0;
    for (let k = 0; k < count; k++) {
      const given = text[at] !== ".";
      let number = 0, power = 1, digit = 0;
      if (!given) at++;
      else if (at < text.length) do {
        digit = LETTERS.indexOf(text[at++]);
        number += (digit % 32) * power;
        power *= 32;
      } while (digit >= 32);
      last += number % 2 ? -(number + 1) / 2 : number / 2;
      values[k] = given ? last / unit : NaN;
    }
    return values;
  }

  // The value at a pose, or between two; behind the last comes the first again, where a turn has so many units.
  function between(values, at, turn) {
    const k = Math.floor(at), part = at - k;
    if (!part) return values[k];
    const step = values[(k + 1) % values.length] - values[k];
    return values[k] + part * (turn ? step - turn * Math.round(step / turn) : step);
  }

  // The pose at a time, by the times of poses up to the last one, between two where it is between two.
  function timed(times, last, time) {
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    return low + (time - times[low]) / (times[high] - times[low] || 1);
  }

  // Index of the smallest of some numbers that are known.
  function least(values) {
    let best = 0, smallest = Infinity;
    values.forEach((value, k) => { if (value < smallest) { smallest = value; best = k; } });
    return best;
  }

  // The pose nearest to a place of the motion at which a track has a value; the place itself where it has one, or none.
  function present(values, at) {
    if (isFinite(between(values, at)) || !values.some(isFinite)) return at;
    return least(values.map((value, k) => isFinite(value) ? Math.abs(k - at) : NaN));
  }

  // Numbers of the poses with their decimals.
  const tracksOf = data => data.numbers.map(([decimals, steps]) => [decimals, decode(steps, data.poses, 10 ** decimals)]);

  // A dot at a place of a drawing, or hidden.
  function put(dot, x, y, visible = isFinite(x + y)) {
    dot.classList.toggle("moving-gone", !visible);
    if (!visible) return;
    dot.setAttribute("cx", x.toFixed(2));
    dot.setAttribute("cy", y.toFixed(2));
  }

  // A picture on which a pointer or the arrow keys choose something.
  function choosing(picture, use) {
    picture.classList.add("moving-map");
    picture.setAttribute("tabindex", "0");
    picture.setAttribute("role", "application");
    picture.setAttribute("aria-label", `${picture.getAttribute("aria-label")}; arrow keys ${use}`);
  }

  // A number in words that are not broken into lines.
  const minus = text => text.replace("-", "\u2212");
  const said = (name, text, unit) => `${name} = ${minus(text)} ${unit}`.trim().replace(" \u00b7", "\u00b7").replaceAll(" ", "\u00a0");

  // A place of the pointer in the units of a drawing.
  function within(drawing, event) {
    const box = drawing.getBoundingClientRect(), size = drawing.viewBox.baseVal;
    return [(event.clientX - box.left) / box.width * size.width, (event.clientY - box.top) / box.height * size.height];
  }

  // Calls back with the places over which the pointer is drawn.
  function follow(drawing, hovering, call) {
    const report = event => {
      if (event.type === "pointerdown") drawing.setPointerCapture(event.pointerId);
      const begins = event.type === "pointerdown";
      if (begins || event.buttons || (hovering && event.pointerType === "mouse")) call(...within(drawing, event), begins);
    };
    drawing.addEventListener("pointerdown", report);
    drawing.addEventListener("pointermove", report);
  }

  // Whether a mechanism moves when its page opens: the one beside the answers, unless the reader prefers less motion.
  const opening = figure => !calm.matches && figure.closest(".stage") !== null;

  // A button that plays and stops: while it plays, `advance` gets the share of the whole motion that has passed, at a
  // rate; where less motion is preferred a larger one now and then.
  function playback(time, advance, {begin = () => {}, end = () => {}, rate = () => 1} = {}) {
    const button = html("button", {type: "button", textContent: "Play"});
    let playing = 0, clock = 0;
    function frame(now) {
      // A part of a page that was replaced moves no more.
      if (!button.isConnected) return;
      if (!calm.matches) { advance(Math.max(0, Math.min(now - clock, 100)) / time * rate()); clock = now; }
      else if (now - clock >= SLOW_PAUSE / rate()) { advance(1 / SLOW_STEPS); clock = now; }
      playing = requestAnimationFrame(frame);
    }
    function stop() {
      if (!playing) return;
      cancelAnimationFrame(playing);
      playing = 0;
      button.textContent = "Play";
      end();
    }
    function play() {
      begin();
      clock = performance.now();
      button.textContent = "Pause";
      playing = requestAnimationFrame(frame);
    }
    const toggle = () => playing ? stop() : play();
    button.addEventListener("click", toggle);
    return {button, stop, play, toggle, playing: () => playing !== 0};
  }

  // The drawing of a mechanism: shows it at a pose, or between two. A part of a drawing, such as the mechanism before a
  // change, is moved by its own data alone.
  function linkage(drawing, data) {
    const own = part => part.closest(".moving-part, svg") === drawing;
    const track = (group, unit) => {
      const tracks = {};
      for (const name in group) tracks[name] = decode(group[name], data.poses, unit);
      return tracks;
    };
    const x = track(data.x, PLACES), y = track(data.y, PLACES), turn = track(data.turn, TURNS);
    const parts = [...drawing.querySelectorAll("[data-at]")].filter(own).map(group => {
      const {at, turn: link, offset} = group.dataset;
      const stays = group.closest(".moving-stays") !== null;
      return [group, x[at], y[at], link === undefined ? null : turn[link], offset && offset.split(" ").map(Number), stays];
    });
    const struts = [...drawing.querySelectorAll("[data-from]")].filter(own).map(path => {
      const {from, to, way} = path.dataset;
      return [path, x[from], y[from], x[to], y[to], way.split(",").map(line => line.match(/\S+ \S+/g).map(corner => corner.split(" ").map(Number)))];
    });
    return {
      x, y,
      show(at) {
        for (const [group, x, y, turn, offset, stays] of parts) {
          // What a hand holds stays in its reach.
          const pose = stays ? present(x, at) : at;
          let px = between(x, pose), py = between(y, pose);
          const finite = isFinite(px), angle = turn ? between(turn, at, 360) : 0;
          group.classList.toggle("moving-gone", !finite);
          if (!finite) continue;
          if (offset) {
            const [cos, sin] = [Math.cos(angle * Math.PI / 180), Math.sin(angle * Math.PI / 180)];
            px += cos * offset[0] - sin * offset[1];
            py += sin * offset[0] + cos * offset[1];
          }
          const place = `translate(${px.toFixed(2)} ${py.toFixed(2)})`;
          group.setAttribute("transform", turn && !offset ? `${place} rotate(${angle.toFixed(3)})` : place);
        }
        for (const [path, x1, y1, x2, y2, lines] of struts) {
          const [px, py] = [between(x1, at), between(y1, at)], [wx, wy] = [between(x2, at) - px, between(y2, at) - py];
          const finite = isFinite(px + wx), length = Math.hypot(wx, wy) || 1;
          path.classList.toggle("moving-gone", !finite);
          if (!finite) continue;
          const corner = ([share, left]) =>
            `${(px + share * wx + left * wy / length).toFixed(2)} ${(py + share * wy - left * wx / length).toFixed(2)}`;
          path.setAttribute("d", lines.map(line => `M${line.map(corner).join("L")}`).join(""));
        }
      },
    };
  }

  // The numbers beside the drawing: their texts at a pose, or between two.
  function numbers(figure, data) {
    const tracks = tracksOf(data);
    const cells = [...document.querySelectorAll(`[data-numbers="${figure.id}"] [data-number]`)].map(cell => [cell, ...tracks[cell.dataset.number]]);
    const text = (decimals, value) => isFinite(value) ? value.toFixed(decimals).replace(/^-(?=[0.]*$)/, "") : "\u2013";
    return {
      tracks,
      text: (which, at) => text(tracks[which][0], between(tracks[which][1], at)),
      show(at) {
        for (const [cell, decimals, values] of cells) cell.textContent = minus(text(decimals, between(values, at)));
      },
    };
  }

  // Arrows of vectors, such as velocities or forces: a layer for each kind, and for each scale one of a round size.
  function arrows(drawing, data, moved, chosen) {
    const way = (x, y) => {
      const length = Math.hypot(x, y), back = Math.min(9, length) / (length || 1);
      return `l${x.toFixed(1)} ${y.toFixed(1)}l${(-back * (x + 0.45 * y)).toFixed(1)} ${(-back * (y - 0.45 * x)).toFixed(1)}` +
        `m${(back * 0.9 * y).toFixed(1)} ${(-back * 0.9 * x).toFixed(1)}L`;
    };
    const track = parts => parts.map(part => decode(part, data.poses, PLACES));
    const size = drawing.viewBox.baseVal, paths = [], boxes = [];
    (data.arrows || []).forEach(({key: [length, words], layers}, row) => {
      const y = size.height - 10 - 24 * row, group = make("g", {"stroke-width": 2}, drawing);
      // Below the handles of a hand.
      drawing.querySelector(".moving-stays")?.before(group);
      const key = make("g", {stroke: "#222222"}, group);
      make("path", {d: `M${size.width - 14 - length} ${y}h${length}m-8 -4l8 4l-8 4`}, key);
      make("text", {x: size.width - 14, y: y - 8, "text-anchor": "end", "font-size": 10, fill: "#222222", stroke: "white",
        "paint-order": "stroke"}, key).textContent = words;
      const drawn = layers.map(({title, color, on, shafts}) => {
        const layer = make("g", {stroke: color, fill: color, "fill-opacity": 0}, group);
        for (const [words, at, parts] of shafts) {
          const path = make("path", {}, layer);
          make("title", {}, path).textContent = `${title}: ${words}`;
          paths.push([path, ...(at.map ? track(at) : [moved.x[at], moved.y[at]]), ...track(parts)]);
        }
        return [title, layer, on, color];
      });
      const update = () => key.classList.toggle("moving-off", drawn.every(([, layer]) => layer.classList.contains("moving-off")));
      boxes.push(...drawn.map(([title, layer, on, color]) => check(title, [layer], chosen(title, on), update, color)));
    });
    return {
      boxes,
      show(at) {
        for (const [path, ...tracks] of paths) {
          const [px, py, x, y] = tracks.map(values => between(values, at));
          const finite = isFinite(x + y + px + py);
          path.classList.toggle("moving-gone", !finite);
          if (finite) path.setAttribute("d", `M${px} ${py}${way(x, y)}${px + x} ${py + y}`);
        }
      },
    };
  }

  // The pictures that follow a motion: a cursor where they are over what moves, dots where they show places. Pointing at
  // one chooses a pose.
  function pictures(figure, data, readout, moved, choose) {
    const [label, track, power, coordinate] = data.over, own = figure.id.replace(/-moving$/, ""), marks = [];
    const over = readout.tracks[track][1].map(value => value * 10 ** power);
    const inStudy = (point, k) => [data.corner[0] + between(moved.x[point], k) / data.scale,
      data.corner[1] - between(moved.y[point], k) / data.scale];

    // A panel over what moves, with a dot on each of its curves.
    function panel(drawing, left, right, top, bottom, low, high, dots) {
      const at = value => left + (right - left) * (value - low) / (high - low);
      const cursor = make("line", {y1: top, y2: bottom, stroke: "#222222", "stroke-width": 1, class: "moving-cursor"}, drawing);
      const drawn = dots.map(([, which, slope, start, color]) =>
        [readout.tracks[which][1], slope, start, make("circle", {r: 3.6, fill: color, stroke: "white"}, drawing)]);
      marks.push(pose => {
        const x = at(between(over, pose));
        const inside = x >= Math.min(left, right) - 1 && x <= Math.max(left, right) + 1;
        cursor.classList.toggle("moving-gone", !inside);
        cursor.setAttribute("x1", x);
        cursor.setAttribute("x2", x);
        for (const [values, slope, start, dot] of drawn) {
          const y = start + slope * between(values, pose);
          put(dot, x, y, inside && y >= top - 0.5 && y <= bottom + 0.5);
        }
      });
      return place => least(over.map(value => Math.abs(at(value) - place)));
    }

    // A part of the plane, with a dot at each point that is of interest.
    function plane(drawing, left, right, top, bottom, west, east, south, north) {
      const at = ([x, y]) => [left + (right - left) * (x - west) / (east - west), bottom - (bottom - top) * (y - south) / (north - south)];
      for (const [point, color] of data.traced) {
        const dot = make("circle", {r: 4, fill: color, stroke: "white", "stroke-width": 1.4, class: "moving-dot"}, drawing);
        marks.push(pose => {
          const [x, y] = at(inStudy(point, pose));
          put(dot, x, y, x >= left && x <= right && y >= top && y <= bottom);
        });
      }
    }

    for (const drawing of document.querySelectorAll(`[data-moves="${figure.id}"] svg[data-axes]`)) {
      // A number of the pose counts poses of its own question only.
      const alike = coordinate || drawing.closest("[data-moves]").id === own;
      const motion = Boolean(drawing.closest(`[data-beside="${figure.id}"]`));
      let chosen = null;
      JSON.parse(drawing.dataset.axes).forEach(([name, ...edges], k) => {
        if (name === "plane") plane(drawing, ...edges);
        else if (name === label && alike)
          chosen = panel(drawing, ...edges, motion ? data.dots.filter(dot => dot[0] === k) : []);
      });
      if (chosen) {
        drawing.classList.add("moving-curves");
        follow(drawing, true, place => choose(chosen(place)));
      }
    }
    return {marks, inStudy};
  }

  // Round numbers between two, at most some eight.
  function ticks(low, high) {
    const raw = (high - low) / 6, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find(factor => factor * power >= raw), marks = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) marks.push(Number((k * step).toPrecision(12)));
    return marks;
  }

  // Any number of the motion over any other, which the reader picks, as a curve with a dot at the pose. Returns what
  // moves the dot, and what takes new numbers.
  function chart(figure, data, readout, choose) {
    const room = document.querySelector(`[data-chart="${figure.id}"]`), none = {mark: () => {}, take: () => {}};
    if (!room) return none;

    // The numbers of the table beside the drawing.
    function listed() {
      const table = document.querySelector(`[data-numbers="${figure.id}"] .moving-numbers`), tracks = [];
      const heads = table ? [...table.tHead.rows[0].cells].map(cell => cell.textContent) : [];
      for (const row of table ? table.tBodies[0].rows : []) [...row.cells].forEach((cell, k) => {
        const number = cell.querySelector("[data-number]"), name = row.cells[0].firstChild.textContent;
        if (!number) return;
        const unit = cell.textContent.slice(number.textContent.length).trim().replace(/^\u00b7/, "");
        const title = k > 1 ? `${heads[k]} of ${name}` : name;
        tracks.push({values: readout.tracks[number.dataset.number][1], title, label: unit ? `${title} [${unit}]` : title});
      });
      return tracks;
    }

    let tracks = listed();
    if (tracks.length < 2) return none;
    const given = new Set(data.given.map(([name]) => name)), free = tracks.filter(({title}) => !given.has(title));
    const drawing = make("svg", {viewBox: "0 0 576 330", role: "img", "font-family": "'DejaVu Sans',Verdana,Geneva,sans-serif",
      "font-size": 10, class: "moving-curves"}, room.querySelector("div"));
    const options = chosen => tracks.map((track, k) => html("option", {value: k, textContent: track.label, selected: track.title === chosen}));
    const pick = (text, name, chosen) => {
      const select = html("select", {}, ...options(chosen.title));
      select.setAttribute("aria-label", name);
      select.addEventListener("change", draw);
      return [select, html("label", {}, text, select)];
    };
    const [x, over] = pick("over", "output across", free[0] || tracks[0]), [y, show] = pick("Show", "output upwards", free[1] || tracks[1]);
    room.querySelector("p").append(show, over);
    const LEFT = 70, RIGHT = 562, TOP = 14, BOTTOM = 284;
    let px, py, place, dot, at = data.first;

    function axis(values) {
      const finite = values.filter(isFinite), low = Math.min(...finite), high = Math.max(...finite);
      const room = 0.04 * (high - low) || 0.05 * Math.abs(high) || 1;
      return finite.length ? [low - room, high + room] : [0, 1];
    }

    function draw() {
      const across = tracks[x.value], up = tracks[y.value];
      const [west, east] = axis(across.values), [south, north] = axis(up.values);
      px = value => LEFT + (RIGHT - LEFT) * (value - west) / (east - west);
      py = value => BOTTOM - (BOTTOM - TOP) * (value - south) / (north - south);
      drawing.replaceChildren();
      drawing.setAttribute("aria-label", `${up.label} over ${across.label}`);
      const text = (words, looks) => { make("text", looks, drawing).textContent = words; };
      for (const value of ticks(west, east)) {
        make("path", {d: `M${px(value).toFixed(1)} ${TOP}V${BOTTOM + 4}`, class: "moving-line"}, drawing);
        text(minus(String(value)), {x: px(value).toFixed(1), y: BOTTOM + 17, "text-anchor": "middle"});
      }
      for (const value of ticks(south, north)) {
        make("path", {d: `M${LEFT - 4} ${py(value).toFixed(1)}H${RIGHT}`, class: "moving-line"}, drawing);
        text(minus(String(value)), {x: LEFT - 8, y: (py(value) + 3.5).toFixed(1), "text-anchor": "end"});
      }
      text(across.label, {x: (LEFT + RIGHT) / 2, y: BOTTOM + 36, "text-anchor": "middle"});
      text(up.label, {transform: `translate(14 ${(TOP + BOTTOM) / 2}) rotate(-90)`, "text-anchor": "middle"});
      const poses = across.values.map((value, k) => [px(value), py(up.values[k])]);
      // A closed motion ends where it begins; an angle that went round does not.
      const far = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]), steps = poses.slice(1).map((pose, k) => far(pose, poses[k]));
      if (far(poses.at(-1), poses[0]) <= 2 * Math.max(...steps.filter(isFinite))) poses.push(poses[0]);
      let pen = "M";
      const way = poses.map(([a, b]) => {
        const step = isFinite(a + b) ? `${pen}${a.toFixed(1)} ${b.toFixed(1)}` : "";
        pen = step ? "L" : "M";
        return step;
      });
      make("path", {d: way.join(""), fill: "none", stroke: "#0072B2", "stroke-width": 1.8, "stroke-linejoin": "round"}, drawing);
      dot = make("circle", {r: 4.5, fill: "#D55E00", stroke: "white", class: "moving-here"}, drawing);
      place = (a, b) => least(poses.slice(0, data.poses).map(([c, d]) => Math.hypot(a - c, b - d)));
      mark(at);
    }

    function mark(pose) {
      at = pose;
      put(dot, px(between(tracks[x.value].values, at)), py(between(tracks[y.value].values, at)));
    }

    follow(drawing, false, (a, b) => choose(place(a, b)));
    room.hidden = false;
    draw();
    return {mark, take(next, numbers) {
      const titles = [x, y].map(select => tracks[select.value].title);
      [data, readout] = [next, numbers];
      tracks = listed();
      [x, y].forEach((select, k) => select.replaceChildren(...options(titles[k])));
      draw();
    }};
  }

  // A box that shows or hides some layers, with a mark of their colour, and calls back then.
  function check(text, layers, on, call = () => {}, color = "") {
    const box = html("input", {type: "checkbox", checked: on});
    const set = () => { layers.forEach(layer => layer.classList.toggle("moving-off", !box.checked)); call(); };
    box.addEventListener("change", set);
    set();
    const label = html("label", {}, box, text);
    if (color) {
      const mark = make("svg", {viewBox: "0 0 18 8", width: 18, height: 8, "aria-hidden": "true"}, label);
      make("path", {d: "M1 4h15m-5 -3l5 3l-5 3", fill: "none", stroke: color, "stroke-width": 2}, mark);
    }
    return label;
  }

  // A motion: a slider, play and pause, speed, and what may be shown. Links with a pose that it passes bring it there.
  function motion(figure, data) {
    const drawing = figure.querySelector("svg"), words = figure.querySelector(".moving-words");
    const choose = pose => { player.stop(); show(pose); };
    const slider = html("input", {type: "range", min: 0, max: data.poses - 1, step: 1, value: data.first});
    slider.setAttribute("aria-label", "pose of the motion");
    const speed = html("select", {}, ...[[0.25, "\u00bc\u00d7"], [0.5, "\u00bd\u00d7"], [1, "1\u00d7"], [2, "2\u00d7"], [4, "4\u00d7"]]
      .map(([value, text]) => html("option", {value, textContent: text, selected: value === 1})));
    const controls = figure.querySelector(".moving-controls"), boxes = html("span", {className: "moving-boxes"});
    const player = playback(1000 * data.seconds, share => {
      const next = ahead(share * whole);
      show(calm.matches ? Math.round(next) % data.poses : next);
    }, {
      begin: () => { if (gap(Math.round(at))) show(data.first); },
      end: () => { if (at % 1) show(Math.round(at) % data.poses); },
      rate: () => Number(speed.value),
    });
    const pace = html("span", {className: "moving-pace"});
    let moved, readout, vectors, before, times, last, whole, movable, at = data.first, forward = data.backwards ? -1 : 1;
    const gap = pose => data.gaps.find(([first, end]) => first <= pose && pose <= end);

    // What is drawn and shown by the data; the boxes that the reader has set stay as they are.
    function begin(numbered) {
      const set = new Map([...boxes.querySelectorAll("input")].map(box => [box.parentNode.textContent, box.checked]));
      const chosen = (title, on) => set.get(title) ?? on, other = drawing.querySelector(".moving-before");
      moved = linkage(drawing, data);
      before = other && linkage(other, {...data.before, poses: data.poses});
      last = data.poses - 1;
      if (numbered) {
        readout = numbers(figure, data);
        times = decode(data.times, data.poses + 1, TIMES);
        whole = Math.max(times[data.poses], times[last]);
        slider.max = last;
        pace.textContent = data.pace;
      }
      // Without numbers, as while a hand moves, there are no arrows: their boxes wait.
      const waiting = numbered || !vectors ? [] : vectors.boxes;
      vectors = arrows(drawing, numbered ? data : {}, moved, chosen);
      vectors.boxes.push(...waiting);
      for (const box of waiting) { box.classList.add("moving-waits"); box.querySelector("input").disabled = true; }
      movable = Object.keys(moved.x).filter(point => [moved.x[point], moved.y[point]].some(values => values.some(value => isFinite(value) && value !== values[data.first])));
      const layer = (title, selector, on) => check(title, [...drawing.querySelectorAll(selector)], chosen(title, on));
      boxes.replaceChildren(layer("Paths", ".moving-trace", true), layer("Link names", ".moving-name", false),
        ...vectors.boxes, ...other ? [layer(data.before.title || "Before", ".moving-before", true)] : []);
    }

    begin(true);
    const {marks, inStudy} = pictures(figure, data, readout, moved, choose), curve = chart(figure, data, readout, choose);
    marks.push(curve.mark);
    controls.append(slider, player.button, html("label", {}, "Speed", speed), boxes, pace);
    controls.hidden = false;

    function show(pose) {
      at = pose;
      // An angle that went round jumps from the last pose to the first: there are the numbers of the nearer one.
      const near = Math.round(pose) % data.poses, broken = gap(near), counted = pose > last ? near : pose;
      moved.show(pose); readout.show(counted); vectors.show(pose);
      if (before) before.show(pose);
      marks.forEach(mark => mark(Math.min(pose, last)));
      const text = (data.title ? `${data.title}: ` : "") +
        data.given.map(([name, unit, which]) => said(name, readout.text(which, counted), unit)).join(", ") +
        (broken ? `: ${broken[2]}` : "");
      words.textContent = text;
      slider.value = near;
      slider.setAttribute("aria-valuetext", text);
      figure.dispatchEvent(new Event("moving-chosen"));
    }

    // Where the motion is after a time: round where it closes, back from its ends and from what cannot be assembled.
    function ahead(spent) {
      let time = between(times, at) + forward * spent;
      if (data.returns) time = ((time % whole) + whole) % whole;
      else if (time < 0 || time > times[last]) { forward = -forward; time = Math.max(0, Math.min(times[last], time)); }
      const next = timed(times, times[data.poses] > times[last] ? data.poses : last, time);
      if (gap(Math.floor(next)) || gap(Math.ceil(next) % data.poses)) { forward = -forward; return Math.round(at); }
      return next;
    }

    // The place of the motion where it passes a pose, between two where it is between two; null where it does not.
    function passing(pose) {
      const key = data.keys.find(names => names.every(([name]) => name in pose));
      const ways = key.map(([name, which, power]) => {
        const [decimals, values] = readout.tracks[which], range = Math.max(...values) - Math.min(...values) || 1;
        const value = Number((pose[name] / 10 ** power).toFixed(decimals));
        return values.map(number => (number - value) / range);
      });
      let best = null, least = NEAR;
      for (let k = 0; k < last; k++) {
        const steps = ways.map(way => way[k + 1] - way[k]), dot = (a, b) => a.reduce((sum, value, j) => sum + value * b[j], 0);
        const length = dot(steps, steps), share = length && Math.min(1, Math.max(0, -dot(ways.map(way => way[k]), steps) / length));
        const far = Math.hypot(...ways.map((way, j) => way[k] + share * steps[j]));
        if (far < least) { least = far; best = k + share; }
      }
      return best;
    }

    // Links in a part of the page that lead to a pose; returns the places of those that the motion passes.
    function leading(room) {
      const passed = [];
      for (const link of room.querySelectorAll(`a[href="#${figure.id}"][data-pose]`)) {
        const place = passing(JSON.parse(link.dataset.pose));
        if (place === null) { link.removeAttribute("href"); continue; }
        passed.push(place);
        link.addEventListener("click", event => {
          event.preventDefault();
          choose(place);
          figure.scrollIntoView({block: "nearest", behavior: calm.matches ? "auto" : "smooth"});
        });
      }
      return passed;
    }

    // The row of the motion that is shown.
    const here = () => between(decode(data.rows, data.poses, ROWS), Math.min(at, last));

    // The place of a row of the motion, between two poses where it is between two.
    function placed(row) {
      const rows = decode(data.rows, data.poses, ROWS), next = rows.findIndex(own => own > row), k = (next < 0 ? rows.length : next) - 1;
      const step = next < 0 ? rows[last] - rows[last - 1] : rows[next] - rows[k];
      return k < 0 ? 0 : Math.min(k + (row - rows[k]) / step, data.returns ? data.poses - 0.01 : last);
    }

    // Shows the motion anew by other data, of places alone or with all numbers, at the pose where it is. Of the drawing
    // stays what is marked to stay, unless `whole` is asked.
    figure.moving = {
      drawing, slider, leading, stop: player.stop,
      go(pose) { const place = passing(pose); if (place !== null) choose(place); return place !== null; },
      seek(row) { choose(placed(row)); },
      value: name => readout.text(data.given.find(([own]) => own === name)[2], Math.min(at, last)),
      words: () => words.textContent, row: here, data: () => data,
      point(name) {
        const pose = present(moved.x[name], Math.min(at, last));
        return [between(moved.x[name], pose), between(moved.y[name], pose)];
      },
      near(name) {
        // Not at the border of what can be assembled: a little rounding makes it impossible there.
        const values = moved.x[name], inner = values.map((value, k) => value + (values[k - 1] ?? 0) + (values[k + 1] ?? 0));
        if (gap(Math.round(at))) choose(present(inner.some(isFinite) ? inner : values, at));
      },
      again() { begin(true); show(at); },
      take(next, markup, entire) {
        const row = here(), room = html("template", {innerHTML: markup}), fresh = room.content.firstChild;
        const stays = part => part.classList.contains("moving-stays") || (!entire && part.classList.contains("moving-kept"));
        [...drawing.children].filter(part => !stays(part)).forEach(part => part.remove());
        drawing.prepend(...fresh.children);
        if (entire) drawing.setAttribute("viewBox", fresh.getAttribute("viewBox"));
        data = {...data, before: undefined, ...next};
        begin("numbers" in next);
        // Poses lie closer where more happens: at the same place of the motion is another one.
        if (next.rows) at = placed(row);
        if ("numbers" in next) curve.take(data, readout);
        show(at);
      },
    };
    leading(document);
    slider.addEventListener("input", () => choose(Number(slider.value)));
    figure.addEventListener("keydown", event => {
      if (event.key === " " && !event.target.matches("button, select, input[type=checkbox]")) {
        event.preventDefault();
        player.toggle();
      }
    });
    // A drag on the linkage moves the point that is nearest to the pointer.
    let held = "";
    follow(drawing, false, (x, y, begins) => {
      const far = (point, k) => Math.hypot(moved.x[point][k] - x, moved.y[point][k] - y);
      if (begins) held = movable[least(movable.map(point => far(point, Math.round(at) % data.poses)))];
      if (held) choose(least(moved.x[held].map((_, k) => far(held, k))));
    });
    show(data.first);
    if (opening(figure)) player.play();
    return {marks, inStudy, points: moved.x, at: () => at};
  }

  // A workspace: the mechanism follows the pointer, or the arrow keys, from pose to pose.
  function workspace(figure, data) {
    const drawing = figure.querySelector("svg"), words = figure.querySelector(".moving-words");
    const map = drawing.querySelector(".moving-region"), legends = [...drawing.querySelectorAll(".moving-legend")];
    const choices = data.choices.map(choice => ({...choice, moved: linkage(drawing, choice), readout: numbers(figure, choice)}));
    const controls = figure.querySelector(".moving-controls");
    let chosen = choices[0], at = chosen.first, forward = 1;
    // Played, it goes along the row of poses that it is in, and back from the ends of the row.
    const player = playback(FRONT_TIME, share => {
      const next = at + forward * share * ROW_POSES, low = Math.floor(next), high = Math.ceil(next);
      const [px, py] = [chosen.moved.x, chosen.moved.y].map(places => places[data.point]);
      const beside = low >= 0 && high < chosen.poses && Math.abs(py[high] - py[low]) < chosen.step && Math.abs(px[high] - px[low]) < 2.5 * chosen.step;
      if (!beside) forward = -forward;
      show(beside ? next : Math.round(at));
    }, {end: () => show(Math.round(at))});
    const move = pose => { player.stop(); show(pose); };

    function show(pose) {
      at = pose;
      chosen.moved.show(at);
      chosen.readout.show(at);
      words.textContent = [chosen.title, ...["x", "y"].map((axis, k) =>
        said(`${data.point}.${axis}`, chosen.readout.text(k, at), data.unit))].filter(Boolean).join(", ");
    }

    // The nearest pose to a place; with a direction the nearest on that side.
    function nearest(x, y, toward) {
      const {x: xs, y: ys} = chosen.moved, px = xs[data.point], py = ys[data.point];
      const behind = k => toward && toward[0] * (px[k] - px[at]) + toward[1] * (py[k] - py[at]) <= 1;
      const far = px.map((_, k) => behind(k) ? NaN : Math.hypot(px[k] - x, py[k] - y));
      return far.some(isFinite) ? least(far) : at;
    }

    follow(drawing, true, (x, y) => { player.stop(); words.removeAttribute("aria-live"); show(nearest(x, y)); });
    choosing(drawing, "move it");
    drawing.addEventListener("pointerdown", () => drawing.focus({preventScroll: true}));
    const keys = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
    drawing.addEventListener("keydown", event => {
      const toward = keys[event.key], step = chosen.step * (event.shiftKey ? 5 : 1);
      if (event.key === "Home") move(chosen.first);
      else if (toward) {
        const {x, y} = chosen.moved;
        player.stop();
        show(nearest(x[data.point][at] + step * toward[0], y[data.point][at] + step * toward[1], toward));
      } else return;
      words.setAttribute("aria-live", "polite");
      event.preventDefault();
    });
    for (const box of document.querySelectorAll(`[data-maps="${figure.id}"] input`)) {
      box.addEventListener("change", () => {
        map.setAttribute("href", box.dataset.href);
        legends.forEach(legend => legend.classList.toggle("moving-off", legend.dataset.index !== box.dataset.index));
        if (choices[box.value] === chosen) return;
        player.stop();
        const {x, y} = chosen.moved, place = [x[data.point][at], y[data.point][at]];
        chosen = choices[box.value];
        show(nearest(...place));
      });
      // A browser that goes back to the page keeps what was chosen.
      if (box.checked) box.dispatchEvent(new Event("change"));
    }
    controls.append(player.button, check("Link names", [...drawing.querySelectorAll(".moving-name")], false));
    controls.append(html("span", {className: "moving-pace", textContent: "Move over the region, or use the arrow keys."}));
    controls.hidden = false;
    show(at);
    if (opening(figure)) player.play();
    return {drawing, data, alike: choices[0]};
  }

  // Marks the place of a motion in the drawing of a workspace.
  function mark({marks, inStudy, points, at}, {drawing, data, alike}) {
    if (!points[data.point]) return;
    const dot = make("circle", {r: 5, fill: "#D55E00", stroke: "white", "stroke-width": 1.6, class: "moving-dot"}, drawing);
    marks.push(pose => {
      const [x, y] = inStudy(data.point, pose);
      put(dot, (x - alike.corner[0]) * alike.scale, (alike.corner[1] - y) * alike.scale);
    });
    marks.at(-1)(at());
  }

  // A front: a click on its picture, or the arrow keys, choose a design; its linkage moves by a slider or by itself.
  function front(figure, data) {
    const drawing = figure.querySelector("svg"), picture = document.querySelector(`[data-beside="${figure.id}"] svg`);
    const words = figure.querySelector(".moving-words");
    const layer = drawing.querySelector(".moving-design"), readout = numbers(figure, data);
    const controls = figure.querySelector(".moving-controls");
    const slider = html("input", {type: "range", min: 0, step: "any"});
    slider.setAttribute("aria-label", "pose of the motion");
    // Back from both ends, unless the motion ends where it began.
    const player = playback(FRONT_TIME, step => {
      share += forward * step;
      if (chosen.returns) share %= 1;
      else if (share > 1 || share < 0) { forward = -forward; share = Math.max(0, Math.min(1, share)); }
      show(place());
    });
    const paths = html("input", {type: "checkbox", checked: true});
    const select = html("select", {}, ...data.choices.map(({number, mark}, k) =>
      html("option", {value: k, textContent: [number, mark].filter(Boolean).join(", ")})));
    for (const [x, y] of data.front) x.forEach((place, k) => data.choices[k].mark ||
      make("circle", {cx: place, cy: y[k], r: 2.6, fill: "#0072B2", stroke: "white", "stroke-width": 0.6}, picture));
    // All side by side; a click on one shows it in the large drawing.
    const grid = document.querySelector(`[data-grid="${figure.id}"]`);
    const tiles = (grid ? data.choices : []).map((data, number) => {
      const button = html("button", {type: "button"}), drawing = make("svg", {viewBox: data.view, fill: "none", "aria-hidden": "true",
        "stroke-linecap": "round", "stroke-linejoin": "round"}, button);
      drawing.innerHTML = data.drawing;
      button.append(...data.words.map(words => html("span", {textContent: words})));
      button.addEventListener("click", () => { choose(number); figure.scrollIntoView({block: "nearest"}); });
      grid.append(button);
      return {button, data, moved: linkage(drawing, data), times: decode(data.times, data.poses, TIMES)};
    });
    if (grid) grid.hidden = false;
    const rings = data.front.map(() => make("circle", {r: 8, fill: "none", stroke: "#222222", "stroke-width": 2,
      class: "moving-chosen"}, picture));
    let k = -1, chosen, moved, own, tracks, share = 0, forward = 1;

    // Shows a design where its motion is as far on as that of the one before.
    function choose(next) {
      k = next;
      chosen = data.choices[k];
      layer.innerHTML = chosen.drawing;
      // Linkages of a synthesis have windows of their own.
      if (chosen.view) drawing.setAttribute("viewBox", chosen.view);
      tiles.forEach(({button}, other) => button.setAttribute("aria-pressed", other === k));
      moved = linkage(drawing, chosen);
      own = decode(chosen.times, chosen.poses, TIMES);
      tracks = tracksOf(chosen);
      layer.querySelectorAll(".moving-trace").forEach(trace => trace.classList.toggle("moving-off", !paths.checked));
      rings.forEach((ring, panel) => {
        ring.setAttribute("cx", data.front[panel][0][k]);
        ring.setAttribute("cy", data.front[panel][1][k]);
      });
      slider.max = chosen.poses - 1;
      select.value = k;
      readout.show(k);
      show(place());
      figure.dispatchEvent(new Event("moving-chosen"));
    }

    const place = () => timed(own, chosen.poses - 1, share);

    function show(pose) {
      const broken = chosen.gaps.find(([first, end]) => first <= Math.round(pose) && Math.round(pose) <= end);
      moved.show(pose);
      const at = chosen.given.map(([name, unit, which]) => said(name, between(tracks[which][1], pose).toFixed(tracks[which][0]), unit));
      words.textContent = `${chosen.title}: ${at.join(", ")}${broken ? `: ${broken[2]}` : ""}`;
      slider.value = pose;
      slider.setAttribute("aria-valuetext", at.join(", "));
      // What does not end where it begins goes back.
      for (const {data, moved, times} of tiles)
        moved.show(timed(times, data.poses - 1, chosen.returns && !data.returns ? 1 - Math.abs(1 - 2 * share) : share));
    }

    slider.addEventListener("input", () => {
      player.stop();
      const at = Number(slider.value);
      share = between(own, at);
      show(at);
    });
    select.addEventListener("change", () => choose(Number(select.value)));
    paths.addEventListener("change", () => choose(k));

    if (picture) {
      choosing(picture, "choose a design");
      follow(picture, false, (x, y) => {
        const best = least(data.choices.map((_, k) => Math.min(...data.front.map(([xs, ys]) => Math.hypot(xs[k] - x, ys[k] - y)))));
        if (best !== k) choose(best);
      });
      const keys = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1};
      picture.addEventListener("keydown", event => {
        const next = event.key === "Home" ? data.first : k + keys[event.key];
        if (!(next >= 0 && next < data.choices.length)) return;
        words.setAttribute("aria-live", "polite");
        event.preventDefault();
        choose(next);
      });
    }
    // Key numbers lead to the design with their variables.
    for (const link of document.querySelectorAll(`a[href="#${figure.id}"][data-pose]`)) {
      const design = JSON.parse(link.dataset.pose);
      const far = data.choices.map((_, k) => Math.hypot(...data.given.map(([name, , which, power]) => {
        const values = readout.tracks[which][1], range = Math.max(...values) - Math.min(...values) || 1;
        return (values[k] - design[name] / 10 ** power) / range;
      })));
      link.addEventListener("click", () => choose(far.indexOf(Math.min(...far))));
    }
    controls.append(slider, player.button, html("label", {}, grid ? "Linkage" : "Design", select), html("label", {}, paths, "Paths"),
      html("span", {className: "moving-pace", textContent: data.pace}));
    controls.hidden = false;
    figure.moving = {drawing, stop: player.stop, playing: player.playing, sheet: () => [...chosen.corner, chosen.scale]};
    choose(data.first);
    if (opening(figure)) player.play();
  }

  function start(room = document) {
    const figures = [...room.querySelectorAll("figure.moving")].map(figure =>
      [figure, JSON.parse(figure.querySelector("script").textContent)]);
    figures.filter(([, data]) => data.front).forEach(part => front(...part));
    const motions = figures.filter(([, data]) => !data.choices).map(part => motion(...part));
    const maps = figures.filter(([, data]) => data.choices && !data.front).map(part => workspace(...part));
    if (motions.length) maps.forEach(map => mark(motions[0], map));
  }

  ready(start);
  // A figure that a page gets later.
  document.addEventListener("moving-new", event => start(event.target.parentNode));
})();
