// A click on a column's name sorts the rows by it, a second one the other way round, a third as they were.
(() => {
  const NUMBERS = {"\u2013": NaN, "\u221e": Infinity, "\u2212\u221e": -Infinity};
  const RAISED = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079\u207b";
  // 2.5 times a power of ten, and a power of ten alone.
  const TEN = new RegExp(`(?:^(-?)|\u00b7)10([${RAISED}]+)$`);
  const power = (_, sign, raised) =>
    `${sign === undefined ? "" : `${sign}1`}e${[...raised].map(digit => "0123456789-"[RAISED.indexOf(digit)]).join("")}`;
  const number = text => text in NUMBERS ? NUMBERS[text] : Number(text.replace(TEN, power));
  const words = new Intl.Collator("en", {numeric: true}).compare;

  // What has no number comes last, whichever way.
  function order(numeric, sign) {
    if (!numeric) return ([a], [b]) => sign * words(a, b);
    return ([a], [b]) => {
      const [x, y] = [number(a), number(b)];
      return isNaN(x) || isNaN(y) ? isNaN(x) - isNaN(y) : sign * (x < y ? -1 : x > y ? 1 : 0);
    };
  }

  function sortable(table) {
    const body = table.tBodies[0], rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = html("button", {type: "button"}, ...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const sort = {none: "ascending", ascending: "descending", descending: "none"}[head.ariaSort || "none"];
        heads.forEach(other => { other.ariaSort = null; });
        if (sort === "none") return body.append(...rows);
        head.ariaSort = sort;
        const keyed = rows.map(row => [row.cells[column].textContent, row]);
        keyed.sort(order(head.classList.contains("number"), sort === "ascending" ? 1 : -1));
        body.append(...keyed.map(([, row]) => row));
      });
    });
    table.caption.append("; a click on a column's name sorts them");
  }

  ready(() => document.querySelectorAll("table.sorted").forEach(sortable));
})();
