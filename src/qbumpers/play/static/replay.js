// The page of a replay: a recorded episode, step by step, with what the assistant saw.

import { Board } from "./board.js";
import { ProjectedCurve } from "./curve.js";
import { byId, element, shown } from "./dom.js";
import { describe, percent, ViewTable } from "./panel.js";

const LONGEST = 1; // seconds that a step may take to be played: pauses are cut
const OF_TURNS = 0.4; // seconds of a step if the record does not say
const MOVE = 110; // milliseconds of a move that is not played

const board = new Board(byId("canvas"));
const view = new ViewTable();
const chart = element("div", { className: "chart" });
const slider = byId("slider");

let task = null;
let frames = [];
let place = 0;
let playing = false;
let due = 0; // when the next step is played, on the page's clock

chart.setAttribute("aria-hidden", "true");
byId("view").append(view.table, view.gauge, element("div", {}, chart));
const curve = new ProjectedCurve(chart);
byId("session").addEventListener("change", showSession);
byId("episode").addEventListener("change", showEpisode);
byId("play").addEventListener("click", () => setPlaying(!playing));
byId("back").addEventListener("click", () => stop(place - 1));
byId("forward").addEventListener("click", () => stop(place + 1));
byId("next").addEventListener("click", () => stop(overrideFrom(1)));
byId("previous").addEventListener("click", () => stop(overrideFrom(-1)));
slider.addEventListener("input", () => stop(slider.valueAsNumber));
byId("focus").addEventListener("keydown", key);
requestAnimationFrame(frame);
showSessions();

async function asked(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

async function showSessions() {
  const sessions = await asked("sessions");
  byId("session").replaceChildren(...sessions.map((each, number) => {
    const option = new Option(`${each.session}: ${each.task}, ${each.episodes} episodes, ${each.steps} steps`, number);
    option.dataset.difference = each.difference;
    return option;
  }));
  await showSession();
}

async function showSession() {
  setPlaying(false);
  const option = byId("session").selectedOptions[0];
  const { difference } = option.dataset;
  byId("verdict").textContent = difference
    ? `Decided again, it comes out differently: ${difference}. What is shown from there on is as it was recorded.`
    : "Decided again: rule and task come to the same in every step.";
  byId("verdict").classList.toggle("good", !difference);
  let found;
  try {
    found = await asked(`sessions/${option.value}`);
  } catch (error) {
    byId("verdict").textContent = `It cannot be shown: ${error.message}.`;
    return;
  }
  task = found.task;
  byId("task").textContent = task.name;
  document.title = `Replay: ${task.name} – Q Bumpers`;
  board.show(task);
  view.show(task);
  byId("episode").replaceChildren(...found.episodes.map((each) => new Option(titled(each), each.episode)));
  byId("episode").value = 0;
  await showEpisode();
}

function titled(episode) {
  const end = episode.success ? "success" : episode.crash ? "crash" : episode.over ? "over" : "not ended";
  const help = episode.assisted ? episode.assistant : "unassisted";
  return `${episode.episode + 1}: ${help}, return ${shown(episode.total)} in ${episode.length} steps, ${end}`;
}

async function showEpisode() {
  setPlaying(false);
  const episode = byId("episode").value;
  frames = episode === "" ? [] : await asked(`sessions/${byId("session").value}/${episode}`);
  slider.max = Math.max(0, frames.length - 1);
  const steps = frames.slice(1);
  curve.whole([
    steps.map((each) => each.step),
    steps.map((each) => each.last.projected),
    steps.map((_, before) => frames[before].view?.floor ?? null),
  ]);
  listOverrides(steps.filter((each) => each.last.overridden));
  go(0, 0);
}

// The same override in steps on end is one entry.
function listOverrides(found) {
  const entries = [];
  for (const { step, last } of found) {
    const text = describe(task, last, "");
    const before = entries.at(-1);
    if (before?.text === text && before.to === step - 1) before.to = step;
    else entries.push({ text, from: step, to: step });
  }
  byId("none").hidden = entries.length > 0;
  byId("log").replaceChildren(...entries.map(({ text, from, to }) => {
    const button = element("button", { type: "button" }, from === to ? `Step ${from}: ` : `Steps ${from} to ${to}: `, element("b", {}, text));
    button.addEventListener("click", () => stop(from));
    return element("li", {}, button);
  }));
}

function overrideFrom(way) {
  for (let step = place + way; step > 0 && step < frames.length; step += way) {
    if (frames[step].last.overridden && (way > 0 || !frames[step - 1].last?.overridden)) return step;
  }
  return place;
}

function stop(step) {
  setPlaying(false);
  go(step, MOVE);
}

// Shows a state; `lasts` milliseconds of movement if it is the next one.
function go(step, lasts) {
  const before = place;
  place = Math.max(0, Math.min(frames.length - 1, step));
  const found = frames[place];
  if (!found) return;
  board.draw(found.scene, place === before + 1 ? lasts : 0, () => {});
  slider.value = place;
  byId("place").textContent = `Step ${place} of ${frames.length - 1}`;
  slider.setAttribute("aria-valuetext", spoken(found));
  curve.mark(place);
  see(found.last);
  byId("return").textContent = shown(found.total);
  byId("overrides").textContent = found.overrides;
  happened(found);
  if (!playing) byId("words").textContent = spoken(found);
}

// What the step was decided by: the state before it.
function see(last) {
  const seen = frames[Math.max(0, place - 1)].view;
  if (seen) view.see(seen);
  view.rows.forEach(({ row }, action) => row.classList.toggle("proposed", last?.proposed === action));
}

function spoken({ step, last, words }) {
  const did = !last ? "" : last.overridden ? `${describe(task, last, "")}. ` : `${task.actions[last.executed]}. `;
  return `Step ${step}: ${did}${words[0].toUpperCase()}${words.slice(1)}.`;
}

function happened({ last, coin, device, reaction }) {
  byId("pressed").textContent = last ? task.actions[last.proposed] : "–";
  byId("executed").textContent = !last ? "–" : last.undone ? "taken back" : task.actions[last.executed];
  byId("override").hidden = !last?.overridden;
  byId("board").classList.toggle("overridden", Boolean(last?.overridden));
  if (last?.overridden) byId("override").textContent = `Assistant: ${describe(task, last, "")}`;
  const parts = [];
  if (last) parts.push(`overridden with probability ${percent(last.probability)}, coin ${shown(coin)}`, `reward ${shown(last.reward)}`);
  if (device && device !== "none") parts.push(`by ${device}`);
  if (device === "none") parts.push("nothing was pressed");
  if (task.rate === 0 && reaction !== null) parts.push(`${Math.round(reaction)} ms after it was shown`);
  byId("how").textContent = parts.length ? `${parts.join("; ")}.` : "Before the first step.";
}

function setPlaying(is) {
  if (is && place >= frames.length - 1) go(0, 0);
  playing = is && frames.length > 1;
  byId("play").textContent = playing ? "Stop" : "Play";
  if (playing) due = performance.now() + lasting(place + 1);
  else if (frames[place]) byId("words").textContent = spoken(frames[place]);
}

// Milliseconds that a step is played for.
function lasting(step) {
  const recorded = frames[step]?.seconds ?? (task.rate > 0 ? 1 / task.rate : OF_TURNS);
  return (1000 * Math.min(LONGEST, Math.max(0, recorded))) / Number(byId("speed").value);
}

function frame(now) {
  if (playing) {
    let step = place;
    while (now >= due && step < frames.length - 1) {
      step += 1;
      due += lasting(step + 1);
    }
    if (step > place) go(step, Math.min(MOVE, lasting(step)));
    if (place >= frames.length - 1) setPlaying(false);
  }
  requestAnimationFrame(frame);
}

function key(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const does = {
    ArrowLeft: () => stop(place - 1), ArrowRight: () => stop(place + 1),
    Home: () => stop(0), End: () => stop(frames.length - 1),
    Space: () => setPlaying(!playing), KeyN: () => stop(overrideFrom(1)), KeyP: () => stop(overrideFrom(-1)),
  }[event.code];
  if (!does) return;
  event.preventDefault();
  does();
}
