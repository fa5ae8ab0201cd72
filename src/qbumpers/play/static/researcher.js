// The researcher's page: asks for the token, which is sent in a header, and shows what it gets.

import { axes } from "./curve.js";
import { byId, colour, element, shown } from "./dom.js";
import uPlot from "./uplot/uPlot.esm.js";

const EVERY = 5000; // milliseconds
const COLOURS = ["--accent", "--warm", "--good", "--purple", "--teal", "--red", "--olive", "--quiet"];

let token = "";
let timer = 0;

byId("form").addEventListener("submit", (event) => {
  event.preventDefault();
  token = byId("token").value.trim();
  look();
});
byId("export").addEventListener("click", download);

const ask = (path) => fetch(path, { headers: { Authorization: `Bearer ${token}` } });

async function look() {
  clearTimeout(timer);
  try {
    const answer = await ask("/researcher/data");
    if (!answer.ok) return say(`Not opened: ${await answer.text()}.`);
    show(await answer.json());
    say(`As of ${new Date().toLocaleTimeString()}`);
  } catch {
    say("The server does not answer; trying again …");
  }
  timer = setTimeout(look, EVERY);
}

const say = (text) => (byId("link").textContent = text);

function show(found) {
  byId("form").hidden = true;
  byId("overview").hidden = false;
  byId("title").textContent = found.title;
  const here = found.people.filter((person) => person.here).length;
  const lost = found.drop_out === null ? "nobody has ended yet" : `drop-out ${(100 * found.drop_out).toFixed(0)} % of those who ended`;
  byId("summary").textContent = `${found.people.length} came, ${here} are here now; ${lost}.`;
  fill("counts", ["condition", "complete", "ongoing", "stale", "ended"], found.counts);
  fill("people", ["participant", "condition", "state", "part", "minutes", "latency"], found.people.map((person) => ({
    ...person, state: person.here ? `${person.state}, here` : person.state,
    latency: person.latency === null ? "–" : `${person.latency.toFixed(0)} ms`,
  })));
  fill("numbers", ["condition", "episode", "kind", "mean", "low", "high", "participants"], found.curves.map((row) => ({
    ...row, episode: row.episode + 1, kind: row.assisted ? "assisted" : "probe",
    mean: shown(row.mean), low: shown(row.low), high: shown(row.high),
  })));
  draw(found.curves);
}

function fill(id, columns, rows) {
  const head = element("tr", {}, ...columns.map((name) => element("th", { scope: "col" }, name)));
  const body = rows.map((row) => element("tr", {}, ...columns.map((name, place) => (
    place ? element("td", {}, String(row[name])) : element("th", { scope: "row" }, String(row[name]))
  ))));
  byId(id).replaceChildren(element("thead", {}, head), element("tbody", {}, ...body));
}

function draw(curves) {
  const place = byId("curves");
  place.replaceChildren();
  if (!curves.length) return;
  const episodes = [...new Set(curves.map((row) => row.episode))].sort((a, b) => a - b);
  const conditions = [...new Set(curves.map((row) => row.condition))];
  const series = conditions.flatMap((condition, number) => [true, false].map((assisted) => ({ condition, assisted, number })));
  const data = series.map(({ condition, assisted }) => episodes.map((episode) => (
    curves.find((row) => row.condition === condition && row.assisted === assisted && row.episode === episode)?.mean ?? null
  )));
  new uPlot({
    width: place.clientWidth, height: 260, cursor: { show: false }, legend: { live: false }, scales: { x: { time: false } }, axes: axes("episode"),
    series: [{ label: "episode" }, ...series.map(({ condition, assisted, number }) => ({
      label: `${condition}, ${assisted ? "assisted" : "probe"}`, stroke: colour(COLOURS[number % COLOURS.length]),
      width: 2, dash: assisted ? [] : [6, 4], spanGaps: true,
    }))],
  }, [episodes.map((episode) => episode + 1), ...data], place);
}

async function download() {
  const answer = await ask("/researcher/export");
  if (!answer.ok) return say(`Not exported: ${await answer.text()}.`);
  const link = element("a", { href: URL.createObjectURL(await answer.blob()), download: "study.zip" });
  link.click();
  URL.revokeObjectURL(link.href);
}
