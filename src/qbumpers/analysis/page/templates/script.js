for (const type of ["mouseover", "focusin", "click"]) {
  document.addEventListener(type, ({ target }) => {
    const point = target.closest?.(".point");
    if (!point) return;
    const plot = point.closest(".points");
    const lines = [point.dataset.name, ...point.dataset.numbers.split("|")];
    plot.querySelectorAll(".shown").forEach((other) => other.classList.remove("shown"));
    point.classList.add("shown");
    plot.querySelector(".readout").replaceChildren(...lines.map((line, place) => {
      const part = document.createElement(place ? "p" : "strong");
      part.textContent = line;
      return part;
    }));
  });
}
document.addEventListener("keydown", ({ key }) => {
  if (key === "Escape") document.querySelectorAll(".enlarge").forEach((box) => { box.checked = false; });
});
