(() => {
  // Says where there is more to the side than a narrow screen shows; a key brings it there, too.
  function look(room) {
    room.classList.toggle("more", room.scrollWidth - room.clientWidth - room.scrollLeft > 8);
    if (room.scrollWidth > room.clientWidth) room.tabIndex = 0;
  }

  // Of several pictures of a question the one that the reader chooses is on the screen; paper has all.
  function choice(room) {
    const figures = [...room.children].filter(figure => !figure.hidden), name = room.closest("section").id;
    if (figures.length < 2) return;
    const show = chosen => figures.forEach(figure => figure.classList.toggle("away", figure !== chosen));
    const choose = html("fieldset", {className: "choice"}, html("legend", {textContent: "Picture to show"}));
    figures.forEach((figure, k) => {
      const box = html("input", {type: "radio", name: `${name}-picture`, checked: !k});
      box.addEventListener("change", () => show(figure));
      choose.append(html("label", {}, box, figure.dataset.short || figure.querySelector("figcaption").textContent));
      // A browser that goes back to the page keeps what was chosen.
      if (box.checked) show(figure);
    });
    room.prepend(choose);
  }

  ready(() => {
    const watcher = new ResizeObserver(entries => entries.forEach(entry => look(entry.target)));
    document.querySelectorAll(".pictures").forEach(choice);
    for (const room of document.querySelectorAll(".scroll, .picture")) {
      watcher.observe(room);
      room.addEventListener("scroll", () => look(room), {passive: true});
    }
  });
})();
