// Filters and sorts the wall of packages. The page is complete without it; nothing is loaded.
(() => {
  const chosen = (id) => document.getElementById(id);
  const wall = document.querySelector(".wall");
  const cards = [...wall.querySelectorAll("article")];
  const byName = (a, b) => (a.dataset.name < b.dataset.name ? -1 : a.dataset.name > b.dataset.name ? 1 : 0);

  const filter = () => {
    const name = chosen("name").value.trim().toLowerCase();
    const fits = ({ dataset }) =>
      dataset.name.toLowerCase().includes(name) &&
      ["profile", "result"].every((key) => ["", dataset[key]].includes(chosen(key).value));
    for (const card of cards) card.hidden = !fits(card);
    chosen("count").value = `${cards.filter((card) => !card.hidden).length} of ${cards.length}`;
  };

  const sort = () => {
    const key = chosen("order").value;
    const order = key === "name" ? byName : (a, b) => b.dataset[key] - a.dataset[key] || byName(a, b);
    wall.append(...[...cards].sort(order));
  };

  for (const id of ["name", "profile", "result"]) chosen(id).addEventListener("input", filter);
  chosen("order").addEventListener("input", sort);
  document.querySelector(".choose").hidden = false;
  filter();
})();
