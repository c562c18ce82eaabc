"use strict";
(() => {
  const REST = 150; // milliseconds after which a hand rests
  const RETRY = 2000; // milliseconds until the page asks a server that is not there again
  const RING = 13; // radius of a handle in the drawing
  const KEEP = "mechdesign-live"; // what outlasts a new version of the file

  function start() {
    const about = JSON.parse(document.getElementById("live-data").textContent), figure = document.getElementById("kinematics-moving");
    const moving = figure.moving, drawing = moving.drawing, page = crypto.randomUUID();
    const hand = document.querySelector(".live-hand"), said = document.querySelector(".live-said"), message = document.querySelector(".live-message");
    const grid = document.querySelector(".live-grid"), dialog = document.querySelector("dialog");
    const rows = new Map([...document.querySelectorAll(".live-number")].map(row => [row.dataset.name, row]));
    const buttons = Object.fromEntries([...document.querySelectorAll("[data-do]")].map(button => [button.dataset.do, button]));
    const dark = new CSSStyleSheet(), colours = new Map(), sections = new Map([...document.querySelectorAll("[data-question]")].map(part => [part.dataset.question, part]));
    const marks = Object.assign(document.createElement("datalist"), {id: "live-marks"});
    figure.append(marks);
    moving.slider.setAttribute("list", marks.id);
    // A drive has a number as well, where its value is what gives the pose.
    for (const [[name], unit] of moving.data().keys.filter(key => key.length === 1).map(([key]) => [key, unitOf(key[0])]).slice(0, 1)) {
      const field = Object.assign(document.createElement("input"), {type: "number", step: "any", className: "live-pose"});
      const label = document.createElement("label");
      label.append(`${name} `, field, ` ${unit}`);
      moving.slider.after(label);
      field.addEventListener("change", () => {
        if (field.value !== "" && !moving.go({[name]: Number(field.value)})) tell(`${name} = ${field.value} is no pose of the motion`);
      });
    }
    document.adoptedStyleSheets = [...document.adoptedStyleSheets, dark];
    let changes = {}, past = [], future = [], set = [], turn = 0, timer = 0, running = false, next = null, asking = null, gesture = null, ended = false;

    function unitOf(name) { return (moving.data().given.find(([own]) => own === name) || ["", ""])[1]; }

    async function post(action, asked, signal) {
      const body = JSON.stringify({version: about.version, page, changes, ...asked});
      const answer = await fetch(action, {method: "POST", body, signal});
      if (!answer.ok) throw new Error(`refused: ${answer.status} ${answer.statusText}`);
      return answer.json();
    }

    // What the page says: of the server and the file above, of the hand beside it.
    const tell = words => { said.textContent = words; };
    function warn(words) { message.textContent = words; message.hidden = !words; }
    const text = value => String(Number(value.toPrecision(10)));

    // Fields, sliders and buttons by the changes.
    function fill() {
      for (const [name, row] of rows) {
        const [field, slider] = row.querySelectorAll("input"), value = changes[name] ?? Number(field.dataset.value);
        row.classList.toggle("changed", name in changes);
        if (document.activeElement !== field || Number(field.value) !== value) field.value = text(value);
        slider.min = Math.min(slider.min, value);
        slider.max = Math.max(slider.max, value);
        slider.value = value;
      }
      const some = Object.keys(changes).length > 0;
      buttons.undo.disabled = !past.length;
      buttons.redo.disabled = !future.length;
      buttons.reset.disabled = buttons.copy.disabled = !some;
      buttons.save.disabled = !some || !about.file;
    }

    // One entry of the history for each gesture, with the changes before it.
    function remember(before) {
      if (JSON.stringify(before) === JSON.stringify(changes)) return;
      past.push(before);
      past = past.slice(-500);
      future = [];
    }

    function restore(to) {
      changes = {...to};
      fill();
      move({});
    }

    const sheet = () => {
      const {corner, scale} = moving.data(), {width, height} = drawing.viewBox.baseVal;
      return [...corner, scale, width, height];
    };

    // Positions: one request under way, and the newest next.
    function move(job) {
      next = job;
      if (asking) asking.abort();
      clearTimeout(timer);
      for (const part of document.querySelectorAll(".live-answer, .live-pictures, [data-numbers]")) part.setAttribute("aria-busy", "true");
      if (!running) run();
    }

    async function run() {
      running = true;
      while (next) {
        const job = next, {poses, rows: places} = moving.data();
        next = null;
        try {
          const answer = await post("move", {...job, poses, rows: places, sheet: sheet(), turn: ++turn});
          if (answer.outdated) { location.reload(); return; }
          if (answer.wrong) { beside(answer.wrong, true); continue; }
          // A gesture that was undone meanwhile does not come back.
          if (job.drag && job.gesture !== gesture && !job.last) continue;
          if (job.drag) { changes = answer.changes; if (gesture) gesture.held = answer.names.length ? answer.names : gesture.held; }
          set = answer.set;
          moving.take(answer.data, answer.drawing);
          fill();
          const lost = answer.data.gaps.reduce((sum, [first, end]) => sum + end - first + 1, 0);
          const gaps = lost ? `${answer.data.gaps[0][2]} at ${lost} of ${poses} poses` : "";
          beside([...answer.words, answer.why, gaps].filter(Boolean).join("\n"), Boolean(answer.why));
        } catch (error) {
          lost(error);
          break;
        }
      }
      running = false;
      timer = setTimeout(ask, REST);
    }

    function beside(words, wrong) {
      hand.textContent = words;
      hand.hidden = !words || !gesture;
      hand.classList.toggle("wrong", wrong);
      if (words) tell(words.replaceAll("\n", ", "));
    }

    // All questions, one after the other, as long as no newer change comes.
    async function ask(fit) {
      if (asking) asking.abort();
      const own = asking = new AbortController(), number = ++turn;
      for (const question of about.questions) {
        const part = sections.get(question), state = part.querySelector(".live-state"), room = part.querySelector(".live-answer");
        room.setAttribute("aria-busy", "true");
        const clock = setInterval(async () => {
          try { state.textContent = (await (await fetch(`progress/${page}`)).json()).progress || "\u2026"; } catch { clearInterval(clock); }
        }, 500);
        try {
          const answer = await post("answer", {question, turn: number, sheet: fit === true && question === "kinematics" ? null : sheet()}, own.signal);
          if (answer.outdated) { location.reload(); return; }
          if (own.signal.aborted || answer.overtaken) return;
          about.questions = answer.order || about.questions;
          warn(about.mistake);
          if (answer.wrong) room.replaceChildren(Object.assign(document.createElement("p"), {className: "failed", textContent: answer.wrong}));
          else show(question, answer, room, fit === true);
          state.textContent = "";
          room.removeAttribute("aria-busy");
        } catch (error) {
          if (error.name !== "AbortError") lost(error);
          return;
        } finally {
          clearInterval(clock);
          if (own.signal.aborted) state.textContent = "";
        }
      }
      // Pictures last: they take longer than numbers.
      for (const question of about.questions) {
        const room = sections.get(question).querySelector(".live-pictures");
        try {
          const answer = await post("pictures", {question, turn: number}, own.signal);
          if (answer.overtaken && own.signal.aborted) return;
          room.innerHTML = answer.html || "";
          if (answer.dark) colour(`${question} pictures`, answer.dark);
          room.removeAttribute("aria-busy");
        } catch (error) {
          if (error.name !== "AbortError") lost(error);
          return;
        }
      }
    }

    function colour(part, rules) {
      colours.set(part, rules);
      dark.replaceSync([...colours.values()].join(""));
    }

    function show(question, answer, room, fit) {
      set = answer.set;
      if (answer.data) {
        const numbers = document.querySelector("[data-numbers]");
        numbers.innerHTML = answer.numbers;
        numbers.removeAttribute("aria-busy");
        colour("drawing", answer.dark);
        moving.take(answer.data, answer.drawing, fit);
      }
      room.innerHTML = answer.html;
      const dead = room.querySelector(".live-dead"), places = dead ? moving.leading(dead) : [];
      for (const part of room.children) if (part !== dead) moving.leading(part);
      // Dead centres are marked along the motion.
      if (question === "kinematics") marks.replaceChildren(...places.map(place => Object.assign(document.createElement("option"), {value: Math.round(place)})));
    }

    function lost(error) {
      ended = true;
      warn(`The server does not answer (${error.message}). What is here stays; start mechdesign live again and open its new address.`);
    }

    // Rings at the points that a hand may move.
    const space = "http://www.w3.org/2000/svg", handles = document.createElementNS(space, "g");
    handles.setAttribute("class", "moving-stays");
    for (const point of about.points) {
      const ring = document.createElementNS(space, "g"), circle = document.createElementNS(space, "circle");
      ring.setAttribute("class", "live-handle");
      ring.setAttribute("data-at", point);
      ring.setAttribute("tabindex", "0");
      ring.setAttribute("role", "button");
      ring.setAttribute("aria-label", `point ${point}: drag it, or use the arrow keys`);
      circle.setAttribute("r", RING);
      ring.append(circle);
      handles.append(ring);
      ring.addEventListener("keydown", event => keyed(event, point));
      ring.addEventListener("pointerdown", event => grasp(event, point, ring));
    }
    drawing.append(handles);
    moving.again();
    drawing.setAttribute("role", "group");

    const here = point => {
      const {x, y} = moving.points(), k = moving.row(), {corner, scale} = moving.data();
      return [corner[0] + x[point][k] / scale, corner[1] - y[point][k] / scale];
    };
    const snapped = place => {
      const size = Number(grid.value);
      return size > 0 ? place.map(value => Math.round(value / size) * size) : place;
    };
    const row = () => moving.rows()[moving.row()];
    const locked = () => [...rows].filter(([, part]) => part.querySelector("[type=checkbox]").checked).map(([name]) => name);

    function drag(point, to, last) {
      move({drag: {point, to: snapped(to), row: gesture.row, locked: locked(), held: gesture.held}, gesture, last});
    }

    function grasp(event, point, ring) {
      if (event.button) return;
      event.preventDefault();
      event.stopPropagation();
      moving.stop();
      ring.focus({preventScroll: true});
      ring.setPointerCapture(event.pointerId);
      const before = {...changes}, from = within(event), at = here(point);
      gesture = {row: row(), held: []};
      ring.classList.add("held");
      const place = move => {
        const to = within(move), {scale} = moving.data();
        return [at[0] + (to[0] - from[0]) / scale, at[1] - (to[1] - from[1]) / scale];
      };
      const moved = move => {
        move.stopPropagation();
        if (move.pointerId === event.pointerId) { put(move); drag(point, place(move)); }
      };
      const done = async move => {
        if (move.pointerId !== event.pointerId) return;
        for (const [kind, call] of listeners) ring.removeEventListener(kind, call);
        ring.classList.remove("held");
        while (running) await new Promise(resolve => setTimeout(resolve, 5));
        gesture = null;
        hand.hidden = true;
        remember(before);
        fill();
      };
      const listeners = [["pointermove", moved], ["pointerup", done], ["pointercancel", done]];
      for (const [kind, call] of listeners) ring.addEventListener(kind, call);
    }

    function within(event) {
      const box = drawing.getBoundingClientRect(), {width, height} = drawing.viewBox.baseVal;
      return [(event.clientX - box.left) / box.width * width, (event.clientY - box.top) / box.height * height];
    }

    // The words beside the hand.
    function put(event) {
      hand.style.left = `${Math.max(0, Math.min(event.clientX + 18, innerWidth - 220))}px`;
      hand.style.top = `${Math.max(0, Math.min(event.clientY + 18, innerHeight - 80))}px`;
    }

    const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
    async function keyed(event, point) {
      const way = arrows[event.key];
      if (!way) return;
      event.preventDefault();
      event.stopPropagation();
      if (running) return;
      moving.stop();
      const step = (Number(grid.value) || about.step) * (event.shiftKey ? 10 : 1), before = {...changes}, [x, y] = here(point);
      gesture = {row: row(), held: []};
      drag(point, [x + way[0] * step, y + way[1] * step]);
      while (running) await new Promise(resolve => setTimeout(resolve, 5));
      gesture = null;
      hand.hidden = true;
      remember(before);
      fill();
    }

    // Fields and sliders: a gesture ends when the field is left or the slider let go.
    for (const [name, part] of rows) {
      const [field, slider] = part.querySelectorAll("input");
      let before = null;
      const input = value => {
        before ??= {...changes};
        if (value === "" || !isFinite(value)) return;
        changes = {...changes, [name]: Number(value)};
        if (Number(value) === Number(field.dataset.value)) delete changes[name];
        fill();
        move({});
      };
      const done = () => { if (before) remember(before); before = null; fill(); };
      field.addEventListener("input", () => input(field.value));
      slider.addEventListener("input", () => input(slider.value));
      field.addEventListener("change", done);
      slider.addEventListener("change", done);
    }
    document.querySelector(".live-numbers").addEventListener("submit", event => event.preventDefault());

    // A question with an answer: the name of a file, "" for the study's own, or null.
    function asked(title, name) {
      const label = dialog.querySelector("label"), field = dialog.querySelector("input");
      dialog.querySelector("h2").textContent = title;
      label.hidden = name === null;
      field.value = name ?? "";
      dialog.returnValue = "no";
      dialog.showModal();
      (name === null ? dialog.querySelector("[value=no]") : field).focus();
      return new Promise(resolve => dialog.addEventListener("close", () => resolve(dialog.returnValue === "yes" ? field.value : null), {once: true}));
    }

    async function save(name, replace) {
      try {
        const answer = await post("save", {name, replace});
        if (answer.exists) {
          if (await asked(`${answer.exists} is there already. Replace it?`, null) !== null) await save(name, true);
        } else if (answer.wrong) warn(answer.wrong);
        else tell(`Saved as ${answer.saved}${answer.comments ? "" : "; its comments could not be kept"}.`);
        return answer;
      } catch (error) { lost(error); }
    }

    const actions = {
      undo() { future.push({...changes}); restore(past.pop()); },
      redo() { past.push({...changes}); restore(future.pop()); },
      reset() { past.push({...changes}); future = []; restore({}); },
      fit: () => ask(true),
      async copy() {
        const words = set.map(text => `--set '${text.replaceAll("'", "'\\''")}'`).join(" ");
        try { await navigator.clipboard.writeText(words); tell(`Copied: ${words}`); } catch { tell(words); }
      },
      async saveas() {
        const name = await asked("Save a copy of the study, in its folder", about.file.replace(/(\.ya?ml)$/, "_changed$1"));
        if (name) save(name, false);
      },
      async save() {
        if (await asked(`Replace ${about.file} by the study as it is here?`, null) !== null) save("", true);
      },
    };
    for (const [name, button] of Object.entries(buttons)) button.addEventListener("click", actions[name]);
    document.addEventListener("keydown", event => {
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || event.target.matches("input[type=number], input[type=text]")) return;
      const button = buttons[event.shiftKey ? "redo" : "undo"];
      event.preventDefault();
      if (!button.disabled) button.click();
    });

    // Waits for a change of the file: a new version makes the page anew, a mistake is told.
    async function watch() {
      for (;;) {
        try {
          const now = await (await fetch(`changes/${about.version}/${page}`)).json();
          if (ended) { ended = false; warn(about.mistake); move({}); }
          if (now.version !== about.version && !now.mistake) { location.reload(); return; }
          if (now.version !== about.version) {
            about.version = now.version;
            warn(about.mistake = now.mistake);
          }
        } catch (error) {
          lost(error);
          await new Promise(resolve => setTimeout(resolve, RETRY));
        }
      }
    }

    // After a new version of the file what the hand has changed stays, as far as the file has it still.
    const kept = JSON.parse(sessionStorage.getItem(KEEP) || "{}");
    if (kept.page === location.pathname) for (const [name, value] of Object.entries(kept.changes)) {
      if (rows.has(name) && Number(rows.get(name).querySelector("input").dataset.value) !== value) changes[name] = value;
    }
    if (kept.page === location.pathname) {
      moving.slider.value = kept.pose;
      moving.slider.dispatchEvent(new Event("input"));
    }
    addEventListener("pagehide", () => sessionStorage.setItem(KEEP, JSON.stringify({changes, pose: moving.row(), page: location.pathname})));
    fill();
    if (Object.keys(changes).length) move({}); else ask();
    watch();
  }

  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
  else start();
})();
