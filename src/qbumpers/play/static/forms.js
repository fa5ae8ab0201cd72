// Forms: an item becomes a field, and a field gives its answer.

import { element } from "./dom.js";

const MOST_POINTS = 11; // of a scale that is shown as separate points

let fields = 0;

// A field of an item: its element, its answer() and mark(problem), which says what is wrong.
export function field(item, words) {
  const id = `field-${fields++}`;
  const made = makers(item)(item, id, words);
  const problem = element("p", { className: "wrong", id: `${id}-problem`, hidden: true });
  made.box.append(problem);
  return {
    item,
    box: made.box,
    answer: made.answer,
    mark(text) {
      problem.textContent = text;
      problem.hidden = !text;
      if (text) made.first().focus();
    },
    missing: () => item.required && [null, ""].includes(made.answer()),
  };
}

function makers(item) {
  if (item.kind === "choice") return radios;
  if (item.kind === "text") return area;
  if (item.kind === "number") return number;
  return (item.most - item.least) / item.step + 1 > MOST_POINTS ? slider : points;
}

function group(item, options, className) {
  const inputs = options.map(({ input }) => input);
  const labels = options.map(({ input, text }) => element("label", {}, input, text));
  const box = element("fieldset", {}, element("legend", {}, item.text), element("div", { className }, ...labels));
  const chosen = () => inputs.find((input) => input.checked);
  return { box, chosen, first: () => inputs[0] };
}

function radios(item, id) {
  const options = item.options.map((text) => ({ text, input: element("input", { type: "radio", name: id, value: text }) }));
  const made = group(item, options, "options");
  return { ...made, answer: () => made.chosen()?.value ?? null };
}

function points(item, id) {
  const options = [];
  for (let value = item.least; value <= item.most; value += item.step) {
    options.push({ text: String(value), input: element("input", { type: "radio", name: id, value: String(value) }) });
  }
  const made = group(item, options, "points");
  made.box.append(ends(item));
  return { ...made, answer: () => (made.chosen() ? Number(made.chosen().value) : null) };
}

function ends(item) {
  return element("p", { className: "ends" }, element("span", {}, item.low), element("span", {}, item.high));
}

function labelled(item, input) {
  const label = element("label", {}, item.text);
  label.htmlFor = input.id;
  return element("div", { className: "item" }, label, input);
}

// Nothing is answered until it is touched: a slider that starts in the middle is no answer.
function slider(item, id, words) {
  const input = element("input", { type: "range", id, className: "untouched", min: item.least, max: item.most, step: item.step });
  input.value = (item.least + item.most) / 2;
  let touched = false;
  const value = element("span", { className: "value" }, words.choose);
  const touch = () => {
    touched = true;
    input.className = "";
    value.textContent = input.value;
  };
  for (const kind of ["input", "click", "keyup"]) input.addEventListener(kind, (event) => event.key !== "Tab" && touch());
  const box = labelled(item, input);
  box.append(ends(item), value);
  return { box, first: () => input, answer: () => (touched ? Number(input.value) : null) };
}

function number(item, id) {
  const input = element("input", { type: "number", id, min: item.least, max: item.most, step: "any" });
  return { box: labelled(item, input), first: () => input, answer: () => (input.value === "" ? null : Number(input.value)) };
}

function area(item, id) {
  const input = element("textarea", { id, maxLength: 5000 });
  return { box: labelled(item, input), first: () => input, answer: () => input.value.trim() };
}
