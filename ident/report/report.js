"use strict";
// A heading on each cell, for screens too narrow for a table.
for (const table of document.querySelectorAll("table")) {
  const heads = [...table.querySelectorAll("thead th")].map((h) => h.textContent);
  if (!heads.length) continue;
  for (const row of table.querySelectorAll("tr")) {
    [...row.cells].forEach((cell, k) => { if (cell.colSpan === 1) cell.dataset.label = heads[k] || ""; });
  }
}
// What an address names is opened.
function open() {
  let place = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let at = place; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
  if (place) place.scrollIntoView();
}
addEventListener("hashchange", open);
document.addEventListener("click", (event) => {
  const link = event.target.closest("a[href^='#']");
  if (link && link.hash === location.hash) setTimeout(open);
});
open();
// Numbers sort as numbers.
const key = (text) => {
  const plain = text.replace(/\u2212/g, "-").trim();
  return plain !== "" && !isNaN(parseFloat(plain)) && /^[-+.\d]/.test(plain) ? parseFloat(plain) : plain;
};
for (const head of document.querySelectorAll("table.sortable th")) {
  if (!head.closest("thead")) continue;
  head.tabIndex = 0;
  const sort = () => {
    const table = head.closest("table"), k = head.cellIndex, down = head.getAttribute("aria-sort") !== "ascending";
    for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "ascending" : "descending");
    const rows = [...table.rows].slice(1).map((row) => [key(row.cells[k].textContent), row]);
    rows.sort(([a], [b]) => (typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? -1 : 1));
    if (!down) rows.reverse();
    for (const [, row] of rows) row.parentElement.append(row);
  };
  head.addEventListener("click", sort);
  head.addEventListener("keydown", (event) => { if (event.key === "Enter") sort(); });
}
const box = document.getElementById("search"), hits = document.getElementById("hits");
let waiting;
// A number of the scoreboard shows the values that its flight was computed from.
const cases = new Map();
for (const link of document.querySelectorAll("a[data-case]")) {
  cases.set(link.dataset.name.toLowerCase().replace(/\s+/g, "_"), link.dataset.case);
  link.addEventListener("click", () => {
    box.value = "case:" + link.dataset.name.replace(/\s+/g, "_") + " ";
    box.dispatchEvent(new Event("input"));
  });
}
box?.addEventListener("input", () => {
  clearTimeout(waiting);
  waiting = setTimeout(() => {
    const words = box.value.toLowerCase().replace(/\u2212/g, "-").split(/\s+/).filter(Boolean);
    const flown = words.filter((w) => w.startsWith("case:")).map((w) => cases.get(w.slice(5)));
    let count = 0;
    for (const term of document.querySelectorAll("#values details.term")) {
      const name = term.querySelector("summary .sym").textContent.toLowerCase();
      let here = 0;
      for (const row of [...term.querySelectorAll("tr")].slice(1)) {
        const cells = [name, ...[...row.cells].map((cell) => cell.textContent)];
        const text = cells.join(" ").toLowerCase().replace(/\u2212/g, "-"), single = text.split(/[\s(),]+/);
        const holds = (w) => (isNaN(w) ? text.includes(w) : single.some((s) => s !== "" && +s === +w));
        const behind = (row.dataset.cases || "").split(" ");
        row.hidden = !words.every((w) => w.startsWith("case:") || holds(w)) || !flown.every((k) => behind.includes(k));
        here += !row.hidden;
      }
      term.hidden = words.length > 0 && !here;
      term.open = words.length > 0 && here > 0 && here <= 400;
      count += here;
    }
    hits.textContent = words.length ? `${count} values` : "";
  }, 150);
});
