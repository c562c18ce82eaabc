"use strict";
// Says where there is more to the side than a narrow screen shows.
(() => {
  const look = room => room.classList.toggle("more", room.scrollWidth - room.clientWidth - room.scrollLeft > 8);
  const start = () => {
    const watcher = new ResizeObserver(entries => entries.forEach(entry => look(entry.target)));
    for (const room of document.querySelectorAll(".scroll, .picture")) {
      watcher.observe(room);
      room.addEventListener("scroll", () => look(room), {passive: true});
    }
  };
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
  else start();
})();
