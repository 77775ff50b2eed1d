"use strict";

const order = new Intl.Collator("en", { numeric: true, sensitivity: "base" });

/** The number that a cell shows, or NaN. */
function numberOf(text) {
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(text) ? Number(text) : NaN;
}

/** Cells by size where both are numbers, else as words; empty ones and "none" come last, whatever the direction. */
function compare(a, b, direction) {
  const missing = (text) => text === "" || text === "none";
  if (missing(a) || missing(b)) {
    return Number(missing(a)) - Number(missing(b));
  }
  const difference = numberOf(a) - numberOf(b);
  return direction * (Number.isNaN(difference) ? order.compare(a, b) : difference);
}

/** Heads become buttons: ascending, descending, and as the rows were. */
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
      const sense = next[head.getAttribute("aria-sort")];
      heads.forEach((other) => other.setAttribute("aria-sort", other === head ? sense : "none"));
      const direction = sense === "descending" ? -1 : 1;
      const sorted = sense === "none" ? rows : [...rows].sort((a, b) => compare(a.cells[column], b.cells[column], direction));
      body.append(...sorted.map((entry) => entry.row));
    });
  });
}

/** A field above a table: rows that have every word stay. */
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
    const asked = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const { row, text } of rows) {
      row.hidden = !asked.every((word) => text.includes(word));
      shown += row.hidden ? 0 : 1;
    }
    count.textContent = asked.length ? `${shown} of ${rows.length} rows` : `${rows.length} rows`;
  });
  line.className = "filter";
  line.append(label, field, count);
  table.parentElement.before(line);
}

/** A line above a table says so while it is wider than the page. */
function sayWider(frame) {
  const line = document.createElement("p");
  line.className = "more";
  line.textContent = "More columns to the right: scroll, or use the arrow keys in the table.";
  frame.before(line);
  new ResizeObserver(() => {
    line.hidden = frame.scrollWidth <= frame.clientWidth;
  }).observe(frame);
}

/** On paper, what is folded is open. */
function openForPrint() {
  const folded = [...document.querySelectorAll("details:not([open])")];
  folded.forEach((part) => part.setAttribute("open", ""));
  window.addEventListener("afterprint", () => folded.forEach((part) => part.removeAttribute("open")), { once: true });
}

document.querySelectorAll("table.sortable").forEach(makeSortable);
document.querySelectorAll("table.filterable").forEach(makeFilterable);
document.querySelectorAll(".rows").forEach(sayWider);
window.addEventListener("beforeprint", openForPrint);
