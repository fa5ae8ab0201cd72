// What the assistant sees: a row per action, the projected return against the floor, its overrides.

import { element, shown } from "./dom.js";
import { ProjectedCurve } from "./curve.js";

const LONGEST_LOG = 50;

// A row per action, and a sentence on the whole.
export class ViewTable {
  constructor() {
    this.gauge = element("p", { className: "gauge" });
    this.body = element("tbody");
    const heads = ["Action", "Q value", "Projected return", "Override"].map((text) => element("th", { scope: "col" }, text));
    this.table = element("table", {}, element("thead", {}, element("tr", {}, ...heads)), this.body);
  }

  show(task) {
    this.rows = task.actions.map((name) => {
      const cells = [0, 1, 2].map(() => element("span"));
      const bar = element("i", { className: "bar" });
      const row = element("tr", {}, element("th", { scope: "row" }, name));
      cells.forEach((cell, place) => row.append(element("td", {}, ...(place === 2 ? [bar, cell] : [cell]))));
      return { row, cells, bar };
    });
    this.body.replaceChildren(...this.rows.map((each) => each.row));
  }

  see(view) {
    const best = Math.max(...view.values);
    this.rows.forEach(({ row, cells, bar }, action) => {
      row.classList.toggle("best", view.values[action] === best);
      cells[0].textContent = shown(view.values[action]);
      cells[1].textContent = shown(view.projected[action]);
      const chance = view.probabilities[action];
      cells[2].textContent = percent(chance);
      bar.style.width = `${100 * (chance ?? 0)}%`;
    });
    const parts = [`expected at the start ${shown(view.start_value)}`];
    if (view.floor !== null) parts.push(`floor ${shown(view.floor)}`);
    this.gauge.replaceChildren("Best projected return ", element("strong", {}, shown(Math.max(...view.projected))), `; ${parts.join(", ")}.`);
  }
}

export class Panel {
  #floor = null;
  #latest = null;

  constructor(place) {
    this.view = new ViewTable();
    const chart = element("div", { className: "chart" });
    chart.setAttribute("aria-hidden", "true");
    this.log = element("ol", { className: "log", tabIndex: 0 });
    this.log.setAttribute("aria-label", "Overrides, the latest first");
    place.replaceChildren(this.view.table, this.view.gauge, element("div", {}, chart), this.log);
    this.curve = new ProjectedCurve(chart);
  }

  show(task) {
    this.task = task;
    this.view.show(task);
  }

  clear() {
    this.#floor = null;
    this.#latest = null;
    this.curve.clear();
    this.log.replaceChildren();
    this.view.gauge.textContent = "";
  }

  take(state) {
    if (state.view) {
      this.#floor = state.view.floor;
      this.view.see(state.view);
    }
    const { last, episode } = state;
    if (!last) return;
    this.curve.add(episode.length, last.projected, this.#floor);
    if (last.overridden) this.#note(episode.length, last);
  }

  // The same override in steps on end is one entry.
  #note(step, last) {
    const text = describe(this.task, last);
    const before = this.#latest;
    if (before?.text === text && before.to === step - 1) {
      before.to = step;
      before.steps.textContent = `steps ${before.from} to ${step}: `;
      return;
    }
    const steps = element("span", {}, `step ${step}: `);
    this.#latest = { text, from: step, to: step, steps };
    this.log.prepend(element("li", {}, steps, element("b", {}, text)));
    while (this.log.children.length > LONGEST_LOG) this.log.lastChild.remove();
  }
}

// What an override did; `whose` is "your" on the page of who was overridden.
export function describe(task, last, whose = "your ") {
  const proposed = task.actions[last.proposed];
  if (last.undone) return `${whose}${proposed} was taken back`;
  return `${task.actions[last.executed]} instead of ${whose}${proposed}`;
}

export function percent(chance) {
  if (chance === null) return "–";
  return chance > 0 && chance < 0.005 ? "< 1 %" : `${(100 * chance).toFixed(0)} %`;
}
