// The page: what comes from the server is shown, what the participant does is sent.

import { Board } from "./board.js";
import { ChoiceForm } from "./choice.js";
import { LearningCurve } from "./curve.js";
import { byId, shown } from "./dom.js";
import { Input, keysOf } from "./input.js";
import { Link } from "./link.js";
import { describe, Panel } from "./panel.js";

const MOVE = 110; // milliseconds that a move of a turn-based task takes to be seen
const SIGN_OF_LIFE = 250; // milliseconds
const WORDS_EVERY = 2500; // milliseconds between two descriptions of a task in real time
const MOST_QUEUED = 2; // presses that wait for the answer to the one before

const board = new Board(byId("canvas"));
const form = new ChoiceForm(byId("choice"));
const panel = new Panel(byId("view"));
const curve = new LearningCurve(byId("curve"));
const input = new Input(byId("focus"), byId("pad"), press, hold);
const link = new Link(device, heard, linkChanged);

let task = null;
let state = null;
let episodes = [];
let queued = [];
let waiting = false; // for the answer to a press
let shownAt = 0; // when the present state came on the screen
let held = { action: null, device: "keyboard", pressed: null };
let sequence = 0;
let paused = false;
let share = 1;
let worded = -Infinity; // when the state was last put into words
let refresh = 0;
let fade = 0;
let go = () => {};

measureRefresh();
link.open();
setInterval(() => realTime() && playing() && !paused && sendHold(), SIGN_OF_LIFE);
byId("go").addEventListener("click", () => go());
byId("pause").addEventListener("click", () => link.send({ type: paused ? "continue" : "pause" }));
byId("half").addEventListener("click", changeSpeed);
window.addEventListener("blur", () => inFront(false));
window.addEventListener("focus", () => inFront(true));
document.addEventListener("visibilitychange", () => inFront(!document.hidden));

const realTime = () => task !== null && task.rate > 0;
const playing = () => state !== null && !state.episode.over;

function device() {
  return {
    refresh, width: innerWidth, height: innerHeight,
    touch: navigator.maxTouchPoints > 0,
    reduced_motion: matchMedia("(prefers-reduced-motion: reduce)").matches,
  };
}

function heard(message) {
  ({ welcome, state: show, countdown, running, paused: stopped, problem })[message.type]?.(message);
}

function welcome(message) {
  task = message.task;
  episodes = message.history;
  state = null;
  queued = [];
  waiting = false;
  setShare(message.share);
  byId("task").textContent = task.name;
  document.title = `${task.name} – Q Bumpers`;
  byId("clock").hidden = !realTime();
  byId("help").textContent = realTime()
    ? "Hold a key, a button or a gamepad's direction. Keys count while the game has the focus; leaving the page pauses it."
    : "Each key, button or gamepad's direction is a step. Keys count while the game has the focus; it waits for you.";
  board.show(task);
  input.show(task);
  panel.show(task);
  panel.clear();
  form.show(message.offers, message.choice);
  curve.show(episodes);
  if (!episodes.length) {
    byId("words").textContent = "";
    offer("Ready?", `An assistant watches, and may step in. ${keysOf(task)}`, "Play", begin);
  }
}

function show(message) {
  const beginning = state === null || message.episode.episode !== state.episode.episode;
  if (beginning) {
    panel.clear();
    worded = -Infinity;
  }
  state = message;
  waiting = false;
  episodes[message.episode.episode] = message.episode;
  const lasts = realTime() ? 1000 / task.rate / share : MOVE;
  board.draw(message.scene, beginning ? 0 : lasts, (time) => (shownAt = time));
  panel.take(message);
  scores(message.episode);
  say(message);
  if (message.last?.overridden) overridden(message.last);
  if (message.episode.over) return over(message.episode);
  if (beginning && !realTime()) resume();
  if (queued.length) act(...queued.shift());
}

function scores(episode) {
  byId("episode").textContent = episode.episode + 1;
  byId("step").textContent = episode.length;
  byId("return").textContent = shown(episode.total);
  byId("overrides").textContent = episode.overrides;
}

// The state in words, for who does not see the canvas: every step of a turn-based task.
function say(message) {
  const now = performance.now();
  if (realTime() && now - worded < WORDS_EVERY && !message.episode.over) return;
  worded = now;
  const doing = message.last?.overridden ? `The assistant did ${describe(task, message.last)}. ` : "";
  byId("words").textContent = `${doing}${message.words[0].toUpperCase()}${message.words.slice(1)}.`;
}

function overridden(last) {
  byId("override").textContent = `Assistant: ${describe(task, last)}`;
  byId("override").hidden = false;
  byId("board").classList.add("overridden");
  clearTimeout(fade);
  fade = setTimeout(() => {
    byId("override").hidden = true;
    byId("board").classList.remove("overridden");
  }, 1400);
}

function over(episode) {
  queued = [];
  byId("override").hidden = true;
  curve.show(episodes);
  const headline = episode.success ? "You made it" : episode.crash ? "Crashed" : "Episode over";
  const detail = `Return ${shown(episode.total)} in ${episode.length} steps, ${episode.overrides} of them overridden.`;
  // A key that is still being pressed must not begin the next episode.
  setTimeout(() => state?.episode === episode && offer(headline, detail, "Play again", begin), 450);
}

function begin() {
  link.send({ type: "begin", episode: episodes.length, ...form.value });
}

function press(action, kind, time) {
  if (realTime() || !playing() || !byId("overlay").hidden) return;
  if (!waiting) act(action, kind, time);
  else if (queued.length < MOST_QUEUED) queued.push([action, kind, time]);
}

function act(action, kind, time) {
  waiting = link.send({ type: "act", number: state.number, action, device: kind, pressed: time, shown: shownAt });
}

function hold(action, kind, time) {
  held = { action, device: kind, pressed: action === null ? null : time };
  if (realTime() && playing()) sendHold();
}

function sendHold() {
  link.send({ type: "hold", sequence: sequence++, ...held, shown: shownAt });
}

function countdown(message) {
  setPaused(false);
  cover(String(message.seconds), "", "", true);
  byId("focus").focus({ preventScroll: true });
}

function running() {
  setPaused(false);
  resume();
  sendHold();
}

function stopped(message) {
  setPaused(true);
  offer("Paused", message.why ? `Since ${message.why}.` : "", "Go on", () => link.send({ type: "continue" }));
}

function problem(message) {
  waiting = false;
  queued = [];
  notice(message.message);
}

function setPaused(is) {
  paused = is;
  byId("pause").textContent = is ? "Go on" : "Pause";
}

function changeSpeed() {
  setShare(share === 1 ? 0.5 : 1);
  link.send({ type: "speed", share: share === 1 ? "1" : "1/2" });
}

function setShare(value) {
  share = value;
  byId("half").setAttribute("aria-pressed", String(value !== 1));
}

function inFront(focused) {
  if (task !== null) link.send({ type: "focus", focused, at: performance.now() });
}

function linkChanged(what, reason) {
  byId("link").textContent = { open: "Connected", lost: "Connection lost; trying again …" }[what] ?? "Not connected";
  if (what === "open") notice("");
  if (what === "renewed") notice(`A new session has begun: ${reason}.`);
  if (what === "lost" && task) cover("Connection lost", "The game waits, and goes on from here.", "", false);
  const again = () => link.open();
  if (what === "taken") offer("Played elsewhere", `${sentence(reason)}`, "Play here", again);
  if (what === "refused") offer("Stopped", sentence(reason), "Try again", again);
  if (what === "open" && !realTime()) resume();
}

const sentence = (text) => `${text[0]?.toUpperCase() ?? ""}${text.slice(1)}.`;

function notice(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
}

function offer(headline, detail, label, act) {
  cover(headline, detail, label, false);
  go = () => {
    notice("");
    act();
  };
  if (document.hasFocus()) byId("go").focus({ preventScroll: true });
}

function cover(headline, detail, label, light) {
  byId("headline").textContent = headline;
  byId("detail").textContent = detail;
  byId("detail").hidden = !detail;
  byId("go").textContent = label;
  byId("go").hidden = !label;
  byId("overlay").classList.toggle("light", light);
  byId("overlay").hidden = false;
}

function resume() {
  if (state === null && !episodes.length) return;
  byId("overlay").hidden = true;
  byId("focus").focus({ preventScroll: true });
}

// The median of some frames; the server keeps it with the record.
function measureRefresh() {
  const times = [];
  const frame = (now) => {
    times.push(now);
    if (times.length < 12) return requestAnimationFrame(frame);
    const gaps = times.slice(1).map((time, place) => time - times[place]).sort((a, b) => a - b);
    refresh = Math.min(1000, Math.round(1000 / Math.max(1, gaps[5])));
  };
  requestAnimationFrame(frame);
}
