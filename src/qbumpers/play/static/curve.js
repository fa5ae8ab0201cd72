// The participant's returns, episode by episode: a chart, a sentence and a table.

import uPlot from "./uplot/uPlot.esm.js";
import { byId, colour, element, shown } from "./dom.js";

const mean = (numbers) => numbers.reduce((sum, number) => sum + number, 0) / numbers.length;

export class LearningCurve {
  #chart = null;
  #episodes = [];

  constructor(place) {
    this.place = place;
    new ResizeObserver(() => this.#chart?.setSize(sizeOf(place, 190))).observe(place.parentElement);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.#chart?.destroy();
      this.#chart = null;
      this.show(this.#episodes);
    });
  }

  show(episodes) {
    this.#episodes = episodes.filter((episode) => episode.over);
    byId("episodes").hidden = !this.#episodes.length;
    byId("rows").replaceChildren(...this.#episodes.map(row).reverse());
    if (!this.#episodes.length) return;
    byId("progress").textContent = this.#sentence();
    const data = [
      this.#episodes.map((episode) => episode.episode + 1),
      this.#episodes.map((episode) => (episode.assisted ? episode.total : null)),
      this.#episodes.map((episode) => (episode.assisted ? null : episode.total)),
    ];
    if (this.#chart) this.#chart.setData(data);
    else this.#chart = this.#make(data);
  }

  #make(data) {
    const series = (label, name, dash) => ({
      label, stroke: colour(name), width: 2, dash, spanGaps: true,
      points: { show: true, size: 7, fill: colour(name) },
      value: (_, value) => shown(value),
    });
    const options = {
      ...sizeOf(this.place, 190),
      legend: { live: false },
      scales: { x: { time: false, range: (_, low, high) => [low - 0.5, Math.max(high, low + 4) + 0.5] } },
      axes: axes("episode"),
      series: [{ label: "episode" }, series("assisted", "--assisted"), series("unassisted", "--unassisted", [5, 4])],
    };
    return new uPlot(options, data, this.place);
  }

  #sentence() {
    const parts = [[true, "assisted"], [false, "unassisted"]].flatMap(([assisted, word]) => {
      const returns = this.#episodes.filter((e) => e.assisted === assisted).map((e) => e.total);
      if (!returns.length) return [];
      return [`${returns.length} ${word}, mean return ${shown(mean(returns))}, best ${shown(Math.max(...returns))}`];
    });
    return `${parts.join("; ")}.`;
  }
}

// The projected return of what was proposed, over the steps of an episode, against the floor.
export class ProjectedCurve {
  #chart = null;
  #data = [[], [], []];
  #mark = null;

  constructor(place) {
    this.place = place;
    new ResizeObserver(() => this.#chart?.setSize(sizeOf(place, 130))).observe(place.parentElement);
  }

  clear() {
    this.#data = [[], [], []];
    this.#chart?.destroy();
    this.#chart = null;
  }

  add(step, projected, floor) {
    const steps = this.#data[0];
    if (steps.length && steps.at(-1) >= step) return;
    steps.push(step);
    this.#data[1].push(projected);
    this.#data[2].push(floor);
    if (steps.length > 1) this.#show();
  }

  // A whole episode: [steps, projected returns, floors].
  whole(data) {
    this.clear();
    this.#data = data;
    if (data[0].length > 1) this.#show();
  }

  // Draws a line at a step.
  mark(step) {
    this.#mark = step;
    this.#chart?.redraw(false);
  }

  #show() {
    if (this.#chart) return this.#chart.setData(this.#data);
    const options = {
      ...sizeOf(this.place, 130),
      legend: { show: false },
      cursor: { show: false },
      hooks: { draw: [(chart) => this.#drawMark(chart)] },
      scales: { x: { time: false } },
      axes: axes("step"),
      series: [
        { label: "step" },
        { label: "projected return", stroke: colour("--assisted"), width: 2, points: { show: false } },
        { label: "floor", stroke: colour("--unassisted"), width: 2, dash: [5, 4], points: { show: false } },
      ],
    };
    this.#chart = new uPlot(options, this.#data, this.place);
  }

  #drawMark({ ctx, bbox, valToPos }) {
    if (this.#mark === null) return;
    const x = valToPos.call(this.#chart, this.#mark, "x", true);
    ctx.fillStyle = colour("--ink");
    ctx.fillRect(x - devicePixelRatio / 2, bbox.top, devicePixelRatio, bbox.height);
  }
}

// Two axes, the first of whole numbers from 1.
export function axes(label) {
  const look = { stroke: colour("--quiet"), grid: { stroke: colour("--line"), width: 1 }, ticks: { show: false } };
  const whole = (_, ticks) => ticks.map((tick) => (Number.isInteger(tick) && tick > 0 ? String(tick) : ""));
  return [{ ...look, values: whole, label, labelSize: 18, size: 28, labelFont: "12px system-ui" }, { ...look, size: 46 }];
}

function sizeOf(place, height) {
  return { width: Math.max(200, place.parentElement.clientWidth), height };
}

function row(episode) {
  const end = episode.success ? "success" : episode.crash ? "crash" : "over";
  const help = episode.assisted ? episode.assistant : "none";
  const cells = [help, shown(episode.total), episode.length, episode.overrides, end];
  return element("tr", {}, element("th", { scope: "row" }, episode.episode + 1), ...cells.map((cell) => element("td", {}, cell)));
}
