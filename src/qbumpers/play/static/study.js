// The page of a study: shows one part after the other, and sends what is answered.

import { byId, element } from "./dom.js";
import { field } from "./forms.js";
import { Game } from "./game.js";
import { Link } from "./link.js";

const PINGS = 5; // by which the connection is measured
const PING_EVERY = 10_000; // milliseconds
const PAGE = Math.random().toString(36).slice(2); // a reload makes another one

const facts = await (await fetch("/facts")).json();
const { words } = facts;
const arrival = Object.fromEntries([...new URLSearchParams(location.search)].filter(([name]) => ["PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "code"].includes(name)));

let page = null;
let fields = [];
let shownAt = 0;
let lastPing = null;
let pong = () => {};

document.documentElement.lang = facts.language;
document.title = facts.title;
byId("title").textContent = facts.title;
byId("contact").textContent = facts.contact;
byId("pilot").textContent = words.pilot;
byId("pilot").hidden = !facts.pilot;
byId("link").textContent = words.connecting;
byId("withdraw").textContent = words.withdraw;
byId("leaving-title").textContent = words.withdraw_title;
byId("leaving-text").textContent = words.withdraw_sure;
byId("stay").textContent = words.withdraw_no;
byId("leave").textContent = words.withdraw_yes;

const game = new Game(words, (message) => link.send(message), answer);
const link = new Link(hello, heard, linkChanged);
if (facts.needs_code && !arrival.code && !link.known) askForCode();
else link.open();

setInterval(ping, PING_EVERY);
byId("form").addEventListener("submit", (event) => {
  event.preventDefault();
  submit();
});
byId("withdraw").addEventListener("click", () => byId("leaving").showModal());
byId("stay").addEventListener("click", () => byId("leaving").close());
byId("leave").addEventListener("click", () => {
  byId("leaving").close();
  link.send({ type: "withdraw" });
});

function hello() {
  return {
    page: PAGE, arrival, refresh: 0, width: innerWidth, height: innerHeight,
    touch: navigator.maxTouchPoints > 0,
    reduced_motion: matchMedia("(prefers-reduced-motion: reduce)").matches,
  };
}

function heard(message) {
  const takers = {
    page: () => show(message.page), board: () => game.show(message.task), state: () => game.take(message),
    ask: () => game.ask(message), countdown: () => game.countdown(message), running: () => game.running(),
    paused: () => game.paused(), problem: () => problem(message.message),
    pong: () => {
      lastPing = performance.now() - message.at;
      pong(lastPing);
    },
  };
  takers[message.type]?.();
}

function show(next) {
  page = next;
  fields = [];
  shownAt = performance.now();
  notice("");
  game.close();
  byId("progress").textContent = page.places ? words.progress.replace("{part}", page.place).replace("{parts}", page.places) : "";
  byId("heading").textContent = page.title;
  byId("text").replaceChildren(...page.text.map(paragraph));
  byId("withdraw").hidden = !page.withdraw;
  byId("form").replaceChildren();
  ({ consent, "device-check": device, comprehension: form, questionnaire: form, block, sitting, end, debriefing: last }[page.kind] ?? plain)();
  byId("heading").focus({ preventScroll: true });
  scrollTo(0, 0);
}

function paragraph(part) {
  return part.items ? element("ul", {}, ...part.items.map((text) => element("li", {}, text))) : element("p", {}, part.text);
}

function button(text, act, primary = true) {
  const made = element("button", { type: act ? "button" : "submit", className: primary ? "primary" : "" }, text);
  if (act) made.addEventListener("click", act);
  return made;
}

function buttons(...made) {
  byId("form").append(element("div", { className: "choices" }, ...made));
}

function plain() {
  buttons(button(words.next));
}

function last() {
  buttons(button(words.finish));
}

function consent() {
  buttons(button(words.agree, () => answer({ agree: true })), button(words.decline, () => answer({ agree: false }), false));
}

function form() {
  if (page.wrong) notice(words.comprehension_wrong);
  if (page.reminder) byId("text").append(...page.reminder.map(paragraph));
  fields = page.items.map((item) => field(item, words));
  byId("form").append(...fields.map((each) => each.box));
  buttons(button(words.next));
}

function submit() {
  if (page === null) return;
  if (["consent", "device-check", "block"].includes(page.kind)) return;
  for (const each of fields) each.mark("");
  const missing = fields.filter((each) => each.missing()).reverse(); // the focus goes to the first
  for (const each of missing) each.mark(words.answer_needed);
  if (!missing.length) answer(Object.fromEntries(fields.map((each) => [each.item.id, each.answer()])));
}

function answer(content) {
  link.send({ type: "answer", number: page.number, content, shown: shownAt, at: performance.now() });
}

function block() {
  game.open(page);
}

function sitting() {
  byId("text").append(element("p", {}, page.wait));
  farewell();
}

function end() {
  farewell();
}

function farewell() {
  if (page.code) byId("text").append(element("p", { className: "code" }, page.code));
  if (page.link) byId("text").append(element("p", {}, element("a", { className: "button", href: page.link }, words.return_link)));
}

// Measures the screen and the connection, and whether there is a keyboard if that is needed.
async function device() {
  const asked = page;
  const status = element("p", { role: "status" }, words.device_measuring);
  byId("text").append(status);
  const refresh = await measuredRefresh();
  const latency = await measuredLatency();
  if (page !== asked) return;
  let keyboard = false;
  if (page.keyboard) {
    status.textContent = words.device_press_key;
    await new Promise((resolve) => window.addEventListener("keydown", resolve, { once: true }));
    keyboard = true;
  }
  if (page !== asked) return;
  status.textContent = words.device_ready;
  const touch = navigator.maxTouchPoints > 0;
  buttons(button(words.next, () => answer({ refresh, latency, keyboard, touch, width: innerWidth, height: innerHeight })));
  byId("form").querySelector("button").focus({ preventScroll: true });
}

function measuredRefresh() {
  return new Promise((resolve) => {
    const times = [];
    const frame = (now) => {
      times.push(now);
      if (times.length < 20) return requestAnimationFrame(frame);
      const gaps = times.slice(1).map((time, place) => time - times[place]).sort((a, b) => a - b);
      resolve(Math.min(1000, Math.round(1000 / Math.max(1, gaps[9]))));
    };
    requestAnimationFrame(frame);
  });
}

async function measuredLatency() {
  const times = [];
  for (let number = 0; number < PINGS; number++) {
    times.push(await new Promise((resolve) => {
      pong = resolve;
      ping();
    }));
  }
  pong = () => {};
  return Math.round(times.sort((a, b) => a - b)[Math.floor(PINGS / 2)] * 10) / 10;
}

function ping() {
  link.send({ type: "ping", at: performance.now(), last: lastPing });
}

function problem(text) {
  notice(text);
  game.problem();
}

function notice(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
}

function linkChanged(what, reason) {
  byId("link").textContent = { open: words.connected, lost: words.connection_lost }[what] ?? "";
  if (what === "lost" && page?.kind === "block") game.cover(words.connection_lost, words.waiting_for_connection, []);
  if (what === "taken") stop(words.elsewhere, words.continue_here);
  if (what === "refused") facts.needs_code ? askForCode(reason) : stop(reason, words.try_again);
}

function stop(text, label) {
  page = null;
  game.close();
  byId("heading").textContent = words.stopped;
  byId("text").replaceChildren(element("p", {}, text));
  byId("withdraw").hidden = true;
  byId("form").replaceChildren();
  buttons(button(label, () => link.open()));
}

function askForCode(wrong = "") {
  stop(wrong, words.enter);
  byId("link").textContent = "";
  byId("heading").textContent = words.enter_code;
  const input = element("input", { type: "text", id: "own-code", value: arrival.code ?? "" });
  input.setAttribute("aria-labelledby", "heading");
  const enter = () => {
    arrival.code = input.value.trim();
    link.open();
  };
  byId("form").replaceChildren(input);
  buttons(button(words.enter, enter));
  input.addEventListener("keydown", (event) => event.key === "Enter" && (event.preventDefault(), enter()));
}
