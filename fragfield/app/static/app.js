"use strict";
// Keyboard and focus for the pages; the pages themselves are made by the server.
window.fragfield = {
  /** Go to the field of a key, or to the nearest one above it. */
  focus(key) {
    for (; key; key = key.includes(".") ? key.slice(0, key.lastIndexOf(".")) : key.replace(/\[\d+\]$|^[^[]*$/, "")) {
      const found = document.querySelector(`[data-key="${CSS.escape(key)}"]`);
      if (!found) continue;
      found.scrollIntoView({block: "center"});
      const input = found.matches("input,textarea") ? found : found.querySelector("input,textarea,[tabindex]");
      (input || found).focus();
      return;
    }
  },
  /** Bring the link of this page into view, where the strip of pages is wider than the window. */
  current() { document.querySelector("nav a[aria-current]")?.scrollIntoView({block: "nearest", inline: "center"}); },
  /** Go to a cell of a contour. */
  cell(name) { document.querySelector(`[data-cell="${name}"]`)?.focus(); },
};
document.addEventListener("keydown", event => {
  if ((event.ctrlKey || event.metaKey) && event.key === "s") {
    event.preventDefault();
    document.getElementById("save")?.click();
  }
  const digit = event.altKey && !event.ctrlKey && /^Digit[1-6]$/.test(event.code) && Number(event.code.slice(5));
  if (digit) {
    event.preventDefault();
    document.querySelectorAll("nav a")[digit - 1]?.click();
  }
  // Up and down between the cells of a contour.
  const at = event.target.dataset?.cell?.match(/^(\w+)-(\d+)-(\d)$/);
  if (at && (event.key === "ArrowUp" || event.key === "ArrowDown")) {
    event.preventDefault();
    fragfield.cell(`${at[1]}-${Number(at[2]) + (event.key === "ArrowUp" ? -1 : 1)}-${at[3]}`);
  }
});
