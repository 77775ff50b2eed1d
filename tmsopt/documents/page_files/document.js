"use strict";

const collator = new Intl.Collator("en", { numeric: true, sensitivity: "base" });

/** Return the number that a cell shows, or NaN. */
function numberOf(text) {
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(text) ? Number(text) : NaN;
}

/** Compare two cells as numbers if both are numbers, otherwise as words. Empty cells and "none" always come last. */
function compare(a, b, direction) {
  const missing = (text) => text === "" || text === "none";
  if (missing(a) || missing(b)) {
    return Number(missing(a)) - Number(missing(b));
  }
  const difference = numberOf(a) - numberOf(b);
  return direction * (Number.isNaN(difference) ? collator.compare(a, b) : difference);
}

/** Make each heading a button that sorts the rows: first ascending, then descending, then in the original order. */
function makeSortable(table) {
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => ({ row, cells: [...row.cells].map((cell) => cell.textContent.trim()) }));
  const heads = [...table.tHead.rows[0].cells];
  const next = { none: "ascending", ascending: "descending", descending: "none" };
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    head.replaceChildren(button);
    head.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const sorting = next[head.getAttribute("aria-sort")];
      heads.forEach((other) => other.setAttribute("aria-sort", other === head ? sorting : "none"));
      const direction = sorting === "descending" ? -1 : 1;
      const sorted = sorting === "none" ? rows : [...rows].sort((a, b) => compare(a.cells[column], b.cells[column], direction));
      body.append(...sorted.map((entry) => entry.row));
    });
  });
}

/** Put a field above a table; only rows that contain every word in the field are shown. */
function makeFilterable(table, number) {
  const rows = [...table.tBodies[0].rows].map((row) => ({ row, text: [...row.cells].map((c) => c.textContent).join(" ").toLowerCase() }));
  const field = document.createElement("input");
  const label = document.createElement("label");
  const count = document.createElement("span");
  const line = document.createElement("div");
  field.type = "search";
  field.id = `filter-${number}`;
  label.htmlFor = field.id;
  label.textContent = "Rows with";
  count.setAttribute("role", "status");
  count.textContent = `${rows.length} rows`;
  field.addEventListener("input", () => {
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shownCount = 0;
    for (const { row, text } of rows) {
      row.hidden = !words.every((word) => text.includes(word));
      shownCount += row.hidden ? 0 : 1;
    }
    count.textContent = words.length ? `${shownCount} of ${rows.length} rows` : `${rows.length} rows`;
  });
  line.className = "filter";
  line.append(label, field, count);
  table.parentElement.before(line);
}

/** Put a line above a table that is visible while the table is wider than the page. */
function addWidthNote(frame) {
  const line = document.createElement("p");
  line.className = "more";
  line.textContent = "More columns to the right: scroll, or use the arrow keys in the table.";
  frame.before(line);
  new ResizeObserver(() => {
    line.hidden = frame.scrollWidth <= frame.clientWidth;
  }).observe(frame);
}

/** Open folded parts for printing, and close them afterwards. */
function openForPrint() {
  const foldedParts = [...document.querySelectorAll("details:not([open])")];
  foldedParts.forEach((part) => part.setAttribute("open", ""));
  window.addEventListener("afterprint", () => foldedParts.forEach((part) => part.removeAttribute("open")), { once: true });
}

document.querySelectorAll("table.sortable").forEach(makeSortable);
document.querySelectorAll("table.filterable").forEach(makeFilterable);
document.querySelectorAll(".rows").forEach(addWidthNote);
window.addEventListener("beforeprint", openForPrint);
