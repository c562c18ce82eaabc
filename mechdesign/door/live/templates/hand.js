// What pages on which a hand changes a study have in common: the changes with undo, fields, saving, the file watched.
// `react` is called when another change than a drag was made.
function openHand(react) {
  const RETRY = 2000; // milliseconds until the page asks a server that is not there again
  const AWAY = 18; // pixels from the pointer to the words beside it
  const SERIES = 1000; // milliseconds within which presses of keys on a ring are one gesture
  const WAYS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
  const KEEP = "mechdesign-live", MOST = 500; // what outlasts a new version of the file, and gestures that it holds
  const find = selector => document.querySelector(selector), all = selector => [...document.querySelectorAll(selector)];
  const words = find(".live-hand"), said = find(".live-said"), message = find(".live-message"), grid = find(".live-grid");
  const about = JSON.parse(find("#live-data").textContent), dialog = find("dialog"), page = crypto.randomUUID();
  const rows = new Map(all(".live-number").map(row => [row.dataset.name, row]));
  const buttons = Object.fromEntries(all("[data-do]").map(button => [button.dataset.do, button]));
  const locks = new Map([...rows].map(([name, row]) => [name, row.querySelector("[type=checkbox]")]).filter(([, lock]) => lock));
  const dark = new CSSStyleSheet(), colours = new Map();
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, dark];
  let past = [], future = [], ended = false, series = null, notice = ""; // of the file, until the hand changes something else
  let pointer = [0, 0, 1], saving = null, lasting = ""; // a save under way, and what it says until the next change

  const text = value => String(Number(value.toPrecision(7)));
  const base = name => rows.has(name) ? Number(rows.get(name).querySelector("input").dataset.value) : about.entries?.[name];

  const stored = () => JSON.parse(sessionStorage.getItem(KEEP) || "{}");

  const own = {
    about, changes: {}, set: [], held: false, keeping: () => ({}), kept: {}, settled: async () => {},
    value: name => own.changes[name] ?? base(name),

    async post(action, request, signal) {
      const body = JSON.stringify({version: about.version, page, changes: own.changes, ...request});
      const answer = await fetch(action, {method: "POST", body, signal});
      if (!answer.ok) throw new Error(`refused: ${answer.status} ${answer.statusText}`);
      const content = await answer.json();
      // Names of an older version may be gone.
      if (content.outdated) { location.reload(); return new Promise(() => {}); }
      return content;
    },

    // The number in a field, after a comma or a point its decimals; NaN where it is none.
    read(field) {
      const plain = field.value.trim().replace(",", ".").replace("\u2212", "-");
      return plain && isFinite(plain) ? Number(plain) : NaN;
    },
    write(field, text) {
      field.value = text;
      field.setAttribute("aria-valuenow", own.read(field));
    },

    // What the page says: of the server and the file above, of the hand beside it.
    tell(text) { said.textContent = [notice, text].filter(Boolean).join(" "); },
    warn(text) { message.textContent = text; message.hidden = !text; },
    beside(text, wrong) {
      words.textContent = text;
      words.hidden = !text || !own.held;
      words.classList.toggle("wrong", wrong);
      stand();
      if (text) own.tell(text.replaceAll("\n", ", "));
    },
    lost(error) {
      ended = true;
      own.warn(`The server does not answer (${error.message}). What is here stays; start mechdesign live again and open its new address.`);
    },

    // The answer to a question in its room, or why there is none.
    answered(room, answer, show) {
      own.warn(about.mistake);
      if (answer.wrong) room.replaceChildren(html("p", {className: "failed", textContent: answer.wrong}));
      else show(answer);
      room.removeAttribute("aria-busy");
    },

    // Colours of a part of the page on a dark screen.
    colour(part, rules) {
      colours.set(part, rules);
      dark.replaceSync([...colours.values()].join(""));
    },

    // Fields, sliders and buttons by the changes.
    fill() {
      for (const [name, row] of rows) {
        const [field, slider] = row.querySelectorAll("input"), value = own.value(name);
        row.classList.toggle("changed", name in own.changes);
        const typed = own.read(field), typing = document.activeElement === field && (isNaN(typed) || typed === value);
        if (!typing) own.write(field, text(value));
        slider.min = Math.min(slider.min, value);
        slider.max = Math.max(slider.max, value);
        slider.value = value;
      }
      const some = Object.keys(own.changes).length > 0;
      buttons.undo.disabled = !past.length;
      buttons.redo.disabled = !future.length;
      buttons.reset.disabled = buttons.copy.disabled = !some;
      buttons.save.disabled = !some || !about.file;
    },

    // Changes that are those of the file are none.
    put(values) {
      own.changes = {...own.changes, ...values};
      for (const name of Object.keys(values)) if (values[name] === base(name)) delete own.changes[name];
    },

    // One entry of the history for each gesture, with the changes before it; what goes on with a gesture gives the same.
    remember(before) {
      if (JSON.stringify(before) !== JSON.stringify(own.changes)) {
        notice = "";
        if (past.at(-1) !== before) past = [...past, before].slice(-MOST);
        future = [];
      }
      own.fill();
    },

    snapped(place) {
      const size = own.read(grid);
      return size > 0 ? place.map(value => Math.round(value / size) * size) : place;
    },
    step: event => (own.read(grid) || about.step) * (event.shiftKey ? 10 : 1),

    // Presses of keys on a ring that follow one another: one gesture, with the changes before it.
    presses(ring) {
      const now = performance.now();
      if (series?.ring !== ring || now - series.last > SERIES) series = {ring, before: {...own.changes}};
      series.last = now;
      return series;
    },

    // A pointer holds a ring until it lets go: `moved` gets how far it is from where it took it, in pixels.
    grasp(event, ring, moved, done) {
      event.preventDefault();
      event.stopPropagation();
      ring.focus({preventScroll: true});
      ring.setPointerCapture(event.pointerId);
      ring.classList.add("held");
      own.held = true;
      const before = {...own.changes};
      const follow = move => {
        move.stopPropagation();
        if (move.pointerId !== event.pointerId) return;
        pointer = [move.clientX, move.clientY, move.pointerType === "mouse" ? 1 : -1];
        stand();
        moved(move.clientX - event.clientX, move.clientY - event.clientY);
      };
      const end = async move => {
        if (move.pointerId !== event.pointerId) return;
        for (const [kind, call] of listeners) ring.removeEventListener(kind, call);
        ring.classList.remove("held");
        await done();
        own.held = false;
        words.hidden = true;
        own.remember(before);
      };
      const listeners = [["pointermove", follow], ["pointerup", end], ["pointercancel", end]];
      for (const [kind, call] of listeners) ring.addEventListener(kind, call);
    },

    // Pixels of the screen in a unit of a drawing.
    pixels: drawing => drawing.getBoundingClientRect().width / drawing.viewBox.baseVal.width,

    // A ring of a drawing, which a pointer takes hold of (`take`), or an arrow key moves one way (`press`).
    ring(parent, label, radius, take, press) {
      const looks = {class: "live-handle", tabindex: 0, role: "button", "aria-label": `${label}: drag it, or use the arrow keys`};
      const ring = make("g", looks, parent);
      make("circle", {r: radius}, ring);
      ring.addEventListener("blur", () => { series = null; });
      ring.addEventListener("pointerdown", event => { if (!event.button) take(event, ring); });
      ring.addEventListener("keydown", event => {
        const way = WAYS[event.key];
        if (!way) return;
        event.preventDefault();
        event.stopPropagation();
        press(event, ring, way);
      });
      return ring;
    },

    // Progress of a computation in words, until it is stopped.
    clock(state) {
      let on = true;
      const timer = setInterval(async () => {
        try {
          const {progress} = await (await fetch(`progress/${page}`)).json();
          if (on) state.textContent = progress || "\u2026";
        } catch { clearInterval(timer); }
      }, 500);
      return () => { on = false; clearInterval(timer); state.textContent = ""; };
    },

    locked: () => [...locks].filter(([, lock]) => lock.checked).map(([name]) => name),

    // Whether the hand has left changes on the page of an address.
    left: address => Object.keys(stored()[new URL(address, location).pathname]?.changes || {}).length > 0,

    begin() {
      own.fill();
      watch();
    },
  };

  // The words stand beside the pointer, above left of a finger, and where they cover neither it nor another ring.
  function stand() {
    if (words.hidden) return;
    const [x, y, side] = pointer, {width, height} = words.getBoundingClientRect(), {clientWidth, clientHeight} = document.documentElement;
    const taken = [...all(".live-handle:not(.held)").map(ring => ring.getBoundingClientRect()), new DOMRect(x - 8, y - 8, 16, 16)];
    const along = (at, size, way, room) => Math.max(0, Math.min(way > 0 ? at + AWAY : at - AWAY - size, room - size));
    const spots = [[side, side], [side, -side], [-side, side], [-side, -side]]
      .map(([across, down]) => [along(x, width, across, clientWidth), along(y, height, down, clientHeight)]);
    const covers = ([left, top]) => taken.filter(box => left < box.right && box.left < left + width && top < box.bottom && box.top < top + height).length;
    const [left, top] = spots.reduce((best, spot) => covers(spot) < covers(best) ? spot : best);
    words.style.left = `${left}px`;
    words.style.top = `${top}px`;
  }

  // Another change than a drag was made: what was said of the one before holds no more.
  function changed(words) {
    series = null;
    own.fill();
    own.tell(words);
    react();
  }

  // The changes of a step of the history, and what it gives in words.
  async function restore(title, button, step) {
    await own.settled();
    if (own.held || button.disabled) return;
    const before = own.changes;
    own.changes = {...step()};
    const names = Object.keys({...before, ...own.changes}).filter(name => own.value(name) !== (before[name] ?? base(name)));
    const words = name => {
      const row = rows.get(name), [label, unit] = row ? ["label span", ".unit"].map(part => row.querySelector(part).textContent) : [name.replace("mechanism.", ""), ""];
      return `${label} = ${text(own.value(name))} ${unit}`.trim();
    };
    changed(`${title}: ${names.map(words).join(", ")}`);
  }

  // Fields and sliders: a gesture ends when the field is left or the slider let go.
  for (const [name, part] of rows) {
    const [field, slider] = part.querySelectorAll("input");
    let before = null;
    const input = value => {
      before ??= {...own.changes};
      if (!isFinite(value)) return;
      own.put({[name]: value});
      changed("");
    };
    const done = () => { if (before) own.remember(before); before = null; own.fill(); };
    field.addEventListener("input", () => input(own.read(field)));
    slider.addEventListener("input", () => input(Number(slider.value)));
    field.addEventListener("change", done);
    slider.addEventListener("change", done);
  }
  // Of fields for numbers: arrow keys go by one, with Shift by ten; what is no number is refused, and the last one comes back.
  const numeric = call => event => event.target.matches("[role=spinbutton]") && call(event.target, event);
  document.addEventListener("keydown", numeric((field, event) => {
    const way = {ArrowUp: 1, ArrowDown: -1}[event.key], least = Number(field.getAttribute("aria-valuemin") ?? -Infinity);
    if (!way) return;
    event.preventDefault();
    own.write(field, Number(Math.max(least, (own.read(field) || 0) + way * (event.shiftKey ? 10 : 1)).toPrecision(12)));
    for (const kind of ["input", "change"]) field.dispatchEvent(new Event(kind, {bubbles: true}));
  }));
  document.addEventListener("input", numeric(field => { if (isFinite(own.read(field))) field.setAttribute("aria-valuenow", own.read(field)); }));
  document.addEventListener("change", numeric(field => {
    if (isFinite(own.read(field))) return;
    if (field.value.trim()) own.tell(`${field.value} is no number: write it as 3.5 or 3,5`);
    own.write(field, field.getAttribute("aria-valuenow"));
  }), true);
  find(".live-numbers").addEventListener("submit", event => event.preventDefault());

  // A question with an answer: the name of a file, "" for the study's own, or null.
  function question(title, name) {
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
      const answer = await own.post("save", {name, replace});
      if (answer.exists) {
        if (await question(`${answer.exists} is there already. Replace it?`, null) !== null) await save(name, true);
      // A mistake in the file, which is told above, stays there.
      } else if (answer.wrong) own.warn([`Not saved: ${answer.wrong}`, about.mistake].filter(Boolean).join("\n"));
      else own.tell(lasting = `Saved ${name ? "as" : "into"} ${answer.saved}${answer.comments ? "" : "; its comments could not be kept"}.`);
    } catch (error) { own.lost(error); }
  }

  const actions = {
    undo: () => restore("Undone", buttons.undo, () => { future.push({...own.changes}); return past.pop(); }),
    redo: () => restore("Redone", buttons.redo, () => { past.push({...own.changes}); return future.pop(); }),
    reset: () => restore("Reset", buttons.reset, () => { past.push({...own.changes}); future = []; return {}; }),
    async copy() {
      const words = own.set.map(text => `--set '${text.replaceAll("'", "'\\''")}'`).join(" ");
      try { await navigator.clipboard.writeText(words); own.tell(`Copied ${own.set.length === 1 ? "one change" : `${own.set.length} changes`} as --set.`); } catch { own.tell(words); }
    },
    async saveas() {
      const name = await question("Save a copy of the study, in its folder", about.copy);
      if (name) save(name, false);
    },
    async save() {
      if (await question(`Replace ${about.file} by the study as it is here?`, null) !== null) await (saving = save("", true));
    },
  };
  for (const name in actions) buttons[name].addEventListener("click", actions[name]);
  document.addEventListener("keydown", event => {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || !"zy".includes(key) || event.target.matches("input[type=text]")) return;
    event.preventDefault();
    actions[event.shiftKey || key === "y" ? "redo" : "undo"]();
  });

  // Waits for a change of the file: a new version makes the page anew, a mistake is told.
  async function watch() {
    for (;;) {
      try {
        const now = await (await fetch(`changes/${about.version}/${page}`)).json();
        if (ended) { ended = false; own.warn(about.mistake); react(); }
        if (now.version !== about.version && !now.mistake) { await saving; location.reload(); return; }
        if (now.version !== about.version) {
          about.version = now.version;
          own.warn(about.mistake = now.mistake);
        }
      } catch (error) {
        own.lost(error);
        await new Promise(resolve => setTimeout(resolve, RETRY));
      }
    }
  }

  // After a new version of the file what the hand has changed stays, with its history, as far as the file has it still.
  const kept = stored()[location.pathname];
  if (kept) {
    const names = Object.keys(kept.base), gone = names.filter(name => base(name) === undefined);
    const now = entry => Object.fromEntries(names.filter(name => !gone.includes(name))
      .map(name => [name, entry[name] ?? kept.base[name]]).filter(([name, value]) => value !== base(name)));
    const differ = (entry, k, entries) => !k || JSON.stringify(entry) !== JSON.stringify(entries[k - 1]);
    // What the hand has put back is the file's again.
    own.changes = Object.fromEntries(Object.entries(now(kept.changes)).filter(([name]) => name in kept.changes));
    past = [...kept.past.map(now), own.changes].filter(differ).slice(0, -1);
    future = [own.changes, ...kept.future.map(now).reverse()].filter(differ).slice(1).reverse();
    own.kept = kept;
    const lost = gone.length ? [`Undo goes on without ${gone.join(", ")}: the file has no such number any more.`] : [];
    const held = Object.keys(own.changes).filter(name => base(name) !== kept.base[name])
      .map(name => `The file has ${name} ${text(base(name))}, yours ${text(own.changes[name])} stays.`);
    if (lost.length) buttons.undo.title = lost[0];
    notice = [...lost, ...held].join(" ");
    own.tell(kept.said);
    own.write(grid, kept.grid ?? grid.value);
    for (const name of kept.locked || []) if (locks.has(name)) locks.get(name).checked = true;
  }
  addEventListener("pagehide", () => {
    const touched = [own.changes, ...past, ...future].flatMap(Object.keys), pages = stored();
    pages[location.pathname] = {changes: own.changes, past, future, locked: own.locked(), grid: grid.value, base: Object.fromEntries(touched.map(name => [name, base(name)])), said: lasting && said.textContent.endsWith(lasting) ? lasting : "", ...own.keeping()};
    sessionStorage.setItem(KEEP, JSON.stringify(pages));
  });
  return own;
}
