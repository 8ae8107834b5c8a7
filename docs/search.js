// Results of the search page, from the index that search/index.js holds: no server and no network.
(() => {
  "use strict";
  const place = document.getElementById("mkdocs-search-results");
  const box = document.getElementById("mkdocs-search-query");
  if (!place || !window.pages) return;
  const plain = text => text.normalize("NFKD").replace(/[\u0300-\u036f]/g, "").toLowerCase();
  const known = window.pages.map(page => ({...page, head: plain(page.title), body: plain(page.text)}));

  // How well an entry fits: every word must stand in it; in its title, and at the start of a word, it counts more.
  function fit(entry, words) {
    let found = 0;
    for (const word of words) {
      const inHead = entry.head.includes(word), count = entry.body.split(word).length - 1;
      if (!inHead && !count) return 0;
      found += (inHead ? 20 : 0) + (` ${entry.head}`.includes(` ${word}`) ? 10 : 0) + Math.min(count, 10);
    }
    return found / Math.sqrt(1 + entry.body.length / 2000);
  }

  function extract(entry, words) {
    const at = Math.max(0, Math.min(...words.map(word => entry.body.indexOf(word)).filter(index => index >= 0)) - 80);
    return `${at ? "… " : ""}${entry.text.slice(Number.isFinite(at) ? at : 0, at + 240)} …`;
  }

  function show(query) {
    const words = plain(query).split(/\s+/).filter(word => word.length > 1);
    place.replaceChildren();
    if (!words.length) return;
    const best = known.map(entry => [fit(entry, words), entry]).filter(([value]) => value > 0)
      .sort(([one], [other]) => other - one).slice(0, 30);
    const note = document.createElement("p");
    note.textContent = best.length ? `${best.length} results for “${query}”` : `Nothing found for “${query}”`;
    place.append(note);
    for (const [, entry] of best) {
      const item = document.createElement("article"), head = document.createElement("h3"), link = document.createElement("a");
      link.href = `${window.base_url || "."}/${entry.location}`;
      link.textContent = entry.title;
      head.append(link);
      const text = document.createElement("p");
      text.textContent = extract(entry, words);
      item.append(head, text);
      place.append(item);
    }
  }

  const asked = new URLSearchParams(location.search).get("q") || "";
  if (box) {
    box.value = asked;
    box.addEventListener("input", () => show(box.value));
    box.form?.addEventListener("submit", event => { event.preventDefault(); show(box.value); });
  }
  show(asked);
})();
