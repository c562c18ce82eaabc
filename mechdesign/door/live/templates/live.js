ready(() => {
  const REST = 150; // milliseconds after which a hand rests
  const LONG = 1000; // until questions are asked that make designs of their own
  const RING = 13; // radius of a handle in the drawing
  const NEAR = 4; // pixels beside a crank's circle within which a hand turns the crank alone
  const REACHED = 1; // units of the drawing by which a point may miss a wanted place that it has reached

  const figure = document.getElementById("kinematics-moving"), {moving} = figure, {drawing} = moving;
  const own = openHand(() => { drop(); move({}); }), {about} = own;
  const sections = new Map([...document.querySelectorAll("[data-question]")].map(part => [part.dataset.question, part]));
  const marks = html("datalist", {id: "live-marks"});
  figure.append(marks);
  moving.slider.setAttribute("list", marks.id);

  // A drive has a number as well, where its value is what gives the pose.
  function numbered(name) {
    const field = html("input", {type: "text", inputMode: "decimal", role: "spinbutton", autocomplete: "off", className: "live-pose"});
    const [, unit] = moving.data().given.find(([own]) => own === name) || ["", ""];
    moving.slider.after(html("label", {}, `${name} `, field, ` ${unit}`));
    const fill = () => { if (document.activeElement !== field) own.write(field, moving.value(name)); };
    figure.addEventListener("moving-chosen", fill);
    fill();
    field.addEventListener("change", () => {
      const value = own.read(field);
      if (isFinite(value) && !moving.go({[name]: value})) own.tell(`${name} = ${field.value} is no pose of the motion`);
    });
  }
  const key = moving.data().keys.find(key => key.length === 1);
  if (key) numbered(key[0][0]);

  let turn = 0, timer = 0, running = false, waiting = [], asking = null, gesture = null;

  const sheet = () => {
    const {corner, scale} = moving.data(), {width, height} = drawing.viewBox.baseVal;
    return [...corner, scale, width, height];
  };

  // A gesture that was undone, or overtaken by another change, does not come back.
  function drop() {
    if (gesture) gesture.over = true;
    gesture = null;
  }

  // Positions: one request under way, and the newest of a gesture next. What they say of the motion before holds no more.
  function move(job) {
    waiting = [...waiting.filter(one => one.gesture && one.gesture !== job.gesture), job];
    if (asking) asking.abort();
    clearTimeout(timer);
    for (const part of document.querySelectorAll(".live-answer, .live-pictures, [data-numbers], [data-chart]")) part.setAttribute("aria-busy", "true");
    marks.replaceChildren();
    if (!running) run();
  }

  async function run() {
    running = true;
    while (waiting.length) {
      const {drag, gesture: mine} = waiting.shift(), {poses, rows: places} = moving.data();
      if (mine?.over) continue;
      try {
        // A drag goes on from the pose and the numbers of the last answer, which may be newer than the pointer's place.
        const hold = drag && {drag: {...drag, row: mine.row, held: mine.held}};
        const answer = await own.post("move", {...hold, poses, rows: places, sheet: sheet(), turn: ++turn});
        if (mine?.over) continue;
        if (answer.wrong) { own.beside(answer.wrong, true); continue; }
        if (drag) {
          own.changes = answer.changes;
          if (answer.names.length) mine.held = answer.names;
        }
        own.set = answer.set;
        moving.take(answer.data, answer.drawing);
        if (drag && answer.names.includes("")) {
          mine.row = answer.row;
          moving.seek(answer.row);
          answer.words.push(moving.words());
        }
        own.fill();
        own.beside([...answer.words, answer.hint, answer.why, answer.missing].filter(Boolean).join("\n"), Boolean(answer.why));
      } catch (error) {
        own.lost(error);
        break;
      }
    }
    running = false;
    rest();
  }

  // When the hand rests, everything is asked; a point that it has brought out of the drawing is brought back.
  function rest() {
    clearTimeout(timer);
    timer = setTimeout(() => ask(!gesture && outside()), REST);
  }

  // All questions, one after the other, and their pictures, as long as no newer change comes; those that make designs
  // of their own when the hand rests longer.
  async function ask(fit) {
    if (asking) asking.abort();
    const mine = asking = new AbortController(), number = ++turn, goes = () => !mine.signal.aborted;
    for (const room of document.querySelectorAll(".live-answer, .live-pictures")) room.setAttribute("aria-busy", "true");
    const long = about.questions.filter(question => about.long.includes(question)), quick = about.questions.filter(question => !long.includes(question));
    try {
      for (const question of quick) if (!goes() || !await answered(question, number, mine.signal, fit === true)) return;
      for (const question of quick) if (!goes() || !await pictured(question, number, mine.signal)) return;
      if (long.length) await new Promise(resolve => setTimeout(resolve, LONG));
      for (const question of long)
        if (!goes() || !await answered(question, number, mine.signal) || !await pictured(question, number, mine.signal)) return;
    } catch (error) {
      if (error.name !== "AbortError") own.lost(error);
    }
  }

  async function answered(question, number, signal, fit) {
    const part = sections.get(question), room = part.querySelector(".live-answer"), stop = own.clock(part.querySelector(".live-state"));
    try {
      const answer = await own.post("answer", {question, turn: number, sheet: fit && question === "kinematics" ? null : sheet()}, signal);
      if (signal.aborted || answer.overtaken) return false;
      about.questions = answer.order || about.questions;
      own.answered(room, answer, () => show(question, answer, room, fit));
      return true;
    } finally {
      stop();
    }
  }

  async function pictured(question, number, signal) {
    const room = sections.get(question).querySelector(".live-pictures"), answer = await own.post("pictures", {question, turn: number}, signal);
    if (signal.aborted) return false;
    room.innerHTML = answer.html || "";
    if (answer.dark) own.colour(`${question} pictures`, answer.dark);
    room.removeAttribute("aria-busy");
    return true;
  }

  function show(question, answer, room, fit) {
    own.set = answer.set;
    if (answer.data) {
      const numbers = document.querySelector("[data-numbers]");
      numbers.innerHTML = answer.numbers;
      for (const part of [numbers, document.querySelector("[data-chart]")]) part.removeAttribute("aria-busy");
      own.colour("drawing", answer.dark);
      moving.take(answer.data, answer.drawing, fit);
    }
    room.innerHTML = answer.html;
    const dead = room.querySelector(".live-dead"), places = dead ? moving.leading(dead) : [];
    for (const part of room.children) if (part !== dead) moving.leading(part);
    // Dead centres are marked along the motion.
    if (question === "kinematics") marks.replaceChildren(...places.map(place => html("option", {value: Math.round(place)})));
  }

  // Whether a hand has brought a point out of the drawing.
  function outside() {
    const {width, height} = drawing.viewBox.baseVal;
    return about.points.map(moving.point).some(([x, y]) => x < 0 || y < 0 || x > width || y > height);
  }

  const here = point => {
    const [x, y] = moving.point(point), {corner, scale} = moving.data();
    return [corner[0] + x / scale, corner[1] - y / scale];
  };

  function drag(point, to, near) {
    move({drag: {point, to, locked: own.locked(), near}, gesture});
  }

  // Until the last place of the hand is answered; whether its gesture holds.
  async function settled() {
    const mine = gesture;
    while (mine && running) await new Promise(resolve => setTimeout(resolve, 5));
    if (gesture === mine) gesture = null;
    if (mine && outside()) rest();
    return Boolean(mine && !mine.over);
  }
  own.settled = settled;

  function grasp(event, ring, point) {
    const mine = gesture = {row: row(point), held: []}, at = here(point);
    own.grasp(event, ring, (across, down) => {
      if (mine.over) return;
      const pixels = own.pixels(drawing), scale = moving.data().scale * pixels;
      drag(point, own.snapped([at[0] + across / scale, at[1] - down / scale]), NEAR / pixels);
    }, settled);
  }

  // The pose from which a hand takes a point; where it cannot be assembled only pivots have a place, and of the others
  // the ring stands where the nearest pose has it.
  function row(point) {
    moving.stop();
    if (!about.pivots.includes(point)) moving.near(point);
    return moving.row();
  }

  async function keyed(event, ring, way, point) {
    const begin = row(point), step = own.step(event), at = here(point), presses = own.presses(ring);
    gesture = presses.gesture ??= {held: []};
    // Presses add up on the place that is wanted; where the point could not go there they begin anew from where it is.
    if (!running) {
      gesture.row = begin;
      if (presses.to && Math.hypot(presses.to[0] - at[0], presses.to[1] - at[1]) * moving.data().scale > REACHED) presses.to = at;
    }
    gesture.row ??= begin;
    presses.to = own.snapped((presses.to ?? at).map((value, k) => value + way[k] * step));
    drag(point, presses.to, 0);
    if (await settled()) own.remember(presses.before);
  }

  // Rings at the points that a hand may move.
  const handles = make("g", {class: "moving-stays"}, drawing);
  for (const point of about.points) {
    const take = (event, ring) => grasp(event, ring, point), press = (event, ring, way) => keyed(event, ring, way, point);
    own.ring(handles, `point ${point}`, RING, take, press).setAttribute("data-at", point);
  }
  moving.again();
  drawing.setAttribute("role", "group");

  document.querySelector("[data-do=fit]").addEventListener("click", () => ask(true));
  document.querySelector("[data-do=assembly]").addEventListener("click", async () => {
    const before = {...own.changes};
    try {
      const answer = await own.post("assembly", {});
      own.tell(answer.wrong || answer.words);
      if (answer.wrong) return;
      own.changes = answer.changes;
      own.remember(before);
      move({});
    } catch (error) { own.lost(error); }
  });

  if (own.kept.row !== undefined) moving.seek(own.kept.row);
  // Curves are chosen by their labels, as far as there still are such.
  const picks = [...document.querySelectorAll("[data-chart] select")];
  picks.forEach((select, k) => {
    const option = [...select.options].find(({textContent}) => textContent === own.kept.picks?.[k]);
    if (option) select.value = option.value;
  });
  picks[0]?.dispatchEvent(new Event("change"));
  own.keeping = () => ({row: moving.row(), picks: picks.map(select => select.selectedOptions[0]?.textContent)});
  own.begin();
  if (Object.keys(own.changes).length) move({}); else ask();
});
