"use strict";

/** Heads sort their columns: numbers by size, texts by letters; pressed again, the other way round. */
for (const table of document.querySelectorAll("table.sorts")) {
  const heads = [...table.querySelectorAll("thead th")];
  heads.forEach((head, k) => head.firstChild.addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const one of heads) one.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const key = (row) => { const { dataset, textContent } = row.cells[k]; return dataset.value === undefined ? textContent : Number(dataset.value); };
    const before = (a, b) => {
      const [x, y] = [key(a), key(b)];
      if (typeof x === typeof y) return typeof x === "number" ? x - y : x.localeCompare(y, "en", { numeric: true });
      return typeof x === "number" ? -1 : 1;
    };
    const rows = [...table.tBodies[0].rows].sort((a, b) => (down ? before(b, a) : before(a, b)));
    table.tBodies[0].append(...rows);
  }));
}

for (const button of document.querySelectorAll("button.copy")) {
  button.addEventListener("click", async () => {
    const text = button.parentElement.querySelector("code");
    try {
      await navigator.clipboard.writeText(text.textContent);
      button.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(text); // a page from a file may not write there: ready to be copied by hand
    }
  });
}
