// The game in a block: shows states, sends what is pressed, asks whose move it was.

import { Board } from "./board.js";
import { byId, element, shown } from "./dom.js";
import { Input } from "./input.js";

const MOVE = 110; // milliseconds that a move of a turn-based task takes to be seen
const SIGN_OF_LIFE = 250; // milliseconds
const WORDS_EVERY = 2500; // milliseconds between two descriptions of a task in real time
const MOST_QUEUED = 2; // presses that wait for the answer to the one before

export class Game {
  #task = null;
  #state = null;
  #page = null;
  #queued = [];
  #waiting = false; // for the answer to a press
  #shownAt = 0;
  #held = { action: null, device: "keyboard", pressed: null };
  #sequence = 0;
  #paused = false;
  #worded = -Infinity;
  #asking = null;
  #fade = 0;
  #untrusted = 0;
  #blurs = 0;

  // send(message) says something to the server; done(content) goes on when the block is over.
  constructor(words, send, done) {
    Object.assign(this, { words, send, done });
    this.board = new Board(byId("canvas"));
    this.input = new Input(byId("focus"), byId("pad"), (...press) => this.#press(...press), (...held) => this.#hold(...held));
    byId("focus").setAttribute("aria-label", words.game);
    byId("pad").setAttribute("aria-label", words.actions);
    for (const name of ["episode", "step", "return"]) byId(`${name}-word`).textContent = words[name];
    byId("pause").addEventListener("click", () => this.send({ type: this.#paused ? "continue" : "pause" }));
    setInterval(() => this.#realTime && this.#playing && !this.#paused && this.#sendHold(), SIGN_OF_LIFE);
    for (const kind of ["keydown", "pointerdown"]) window.addEventListener(kind, (event) => (this.#untrusted += !event.isTrusted), true);
    window.addEventListener("blur", () => this.#inFront(false));
    window.addEventListener("focus", () => this.#inFront(true));
    document.addEventListener("visibilitychange", () => this.#inFront(!document.hidden));
  }

  get #realTime() { return this.#task !== null && this.#task.rate > 0; }
  get #playing() { return this.#state !== null && !this.#state.episode.over; }

  open(page) {
    this.#page = page;
    this.#state = null;
    this.#queued = [];
    this.#waiting = false;
    this.#asking = null;
    this.#untrusted = this.#blurs = 0;
    byId("game").hidden = false;
    byId("words").textContent = "";
    this.#scores({ episode: page.played, length: 0, total: 0 });
  }

  close() {
    this.#page = this.#state = this.#task = null;
    byId("game").hidden = true;
  }

  show(task) {
    this.#task = task;
    byId("clock").hidden = !this.#realTime;
    byId("help").textContent = this.#realTime ? this.words.keys_clock : this.words.keys_turns;
    this.#setPaused(false);
    this.board.show(task);
    this.board.draw([], 0, () => {}); // nothing of the block before
    this.input.show(task);
    if (this.#page.over) this.#offerEnd("", "");
    else this.#offer("", "", [[this.#page.played ? this.words.play_next : this.words.play, () => this.#begin(this.#page.played)]]);
  }

  take(state) {
    const beginning = this.#state === null || state.episode.episode !== this.#state.episode.episode;
    if (beginning) this.#worded = -Infinity;
    this.#state = state;
    this.#waiting = false;
    this.board.draw(state.scene, beginning ? 0 : this.#realTime ? 1000 / this.#task.rate : MOVE, (time) => (this.#shownAt = time));
    this.#scores(state.episode);
    this.#say(state);
    if (state.override) this.#override(state.override);
    if (state.episode.over) return this.#over(state);
    if (beginning && !this.#realTime) this.resume();
    if (this.#queued.length) this.#act(...this.#queued.shift());
  }

  ask(message) {
    this.#queued = [];
    if (this.#realTime) this.send({ type: "pause" });
    const shownAt = performance.now();
    const say = (answer) => () => {
      this.#asking = null;
      this.send({ type: "attribute", number: message.number, answer, shown: shownAt, at: performance.now() });
      if (this.#realTime) this.send({ type: "continue" });
      else this.resume();
    };
    this.#asking = () => this.#offer(message.text, "", [[this.words.attribution_me, say("me")], [this.words.attribution_assistant, say("assistant")], [this.words.attribution_unsure, say("unsure")]]);
    this.#asking();
  }

  countdown(message) {
    this.#setPaused(false);
    this.cover(String(message.seconds), "", [], true);
    byId("focus").focus({ preventScroll: true });
  }

  running() {
    this.#setPaused(false);
    this.resume();
    this.#sendHold();
  }

  paused() {
    this.#setPaused(true);
    if (this.#asking) return this.#asking();
    this.#offer(this.words.paused, "", [[this.words.go_on, () => this.send({ type: "continue" })]]);
  }

  problem() {
    this.#waiting = false;
    this.#queued = [];
  }

  resume() {
    if (!this.#playing || this.#asking) return;
    byId("overlay").hidden = true;
    byId("focus").focus({ preventScroll: true });
  }

  cover(headline, detail, choices, light = false) {
    byId("override").hidden = true; // it would lie over the question
    byId("headline").textContent = headline;
    byId("headline").hidden = !headline;
    byId("detail").textContent = detail;
    byId("detail").hidden = !detail;
    byId("choices").replaceChildren(...choices.map(([text, act], place) => {
      const button = element("button", { type: "button", className: place ? "" : "primary" }, text);
      button.addEventListener("click", act);
      return button;
    }));
    byId("overlay").classList.toggle("light", light);
    byId("overlay").hidden = false;
  }

  #offer(headline, detail, choices) {
    this.cover(headline, detail, choices);
    if (document.hasFocus()) byId("choices").firstElementChild?.focus({ preventScroll: true });
  }

  #begin(episode) {
    this.send({ type: "begin", episode, assistant: "none" });
  }

  #over(state) {
    this.#queued = [];
    byId("override").hidden = true;
    const { words } = this;
    const headline = state.episode.success ? words.success : state.episode.crash ? words.crash : words.over;
    const detail = words.score.replace("{total}", shown(state.episode.total)).replace("{length}", state.episode.length);
    // A key that is still being pressed must not begin the next episode.
    setTimeout(() => {
      if (this.#state !== state) return;
      if (state.over) return this.#offerEnd(headline, detail);
      this.#offer(headline, detail, [[words.play_next, () => this.#begin(state.episode.episode + 1)]]);
    }, 450);
  }

  #offerEnd(headline, detail) {
    const go = () => this.done({ untrusted: this.#untrusted, blurs: this.#blurs });
    this.#offer(headline || this.words.block_over, headline ? `${detail} ${this.words.block_over}` : detail, [[this.words.next, go]]);
  }

  #scores(episode) {
    byId("episode").textContent = this.words.of.replace("{number}", Math.min(episode.episode + 1, this.#page.episodes)).replace("{total}", this.#page.episodes);
    byId("step").textContent = episode.length;
    byId("return").textContent = shown(episode.total);
  }

  #say(state) {
    const now = performance.now();
    if (this.#realTime && now - this.#worded < WORDS_EVERY && !state.episode.over) return;
    this.#worded = now;
    const help = { true: `${this.words.with_assistant} `, false: `${this.words.without_assistant} ` }[state.assisted] ?? "";
    const done = state.override ? `${state.override}. ` : "";
    byId("words").textContent = `${help}${done}${state.words[0].toUpperCase()}${state.words.slice(1)}.`;
  }

  #override(text) {
    byId("override").textContent = text;
    byId("override").hidden = false;
    byId("board").classList.add("overridden");
    clearTimeout(this.#fade);
    this.#fade = setTimeout(() => {
      byId("override").hidden = true;
      byId("board").classList.remove("overridden");
    }, 1400);
  }

  #press(action, kind, time) {
    if (this.#realTime || !this.#playing || !byId("overlay").hidden) return;
    if (!this.#waiting) this.#act(action, kind, time);
    else if (this.#queued.length < MOST_QUEUED) this.#queued.push([action, kind, time]);
  }

  #act(action, kind, time) {
    this.#waiting = this.send({ type: "act", number: this.#state.number, action, device: kind, pressed: time, shown: this.#shownAt });
  }

  #hold(action, kind, time) {
    this.#held = { action, device: kind, pressed: action === null ? null : time };
    if (this.#realTime && this.#playing) this.#sendHold();
  }

  #sendHold() {
    this.send({ type: "hold", sequence: this.#sequence++, ...this.#held, shown: this.#shownAt });
  }

  #setPaused(is) {
    this.#paused = is;
    byId("pause").textContent = is ? this.words.go_on : this.words.pause;
  }

  #inFront(focused) {
    if (this.#task === null) return;
    this.#blurs += !focused;
    this.send({ type: "focus", focused, at: performance.now() });
  }
}
