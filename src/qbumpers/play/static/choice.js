// The form: who assists in the next episode, with which options, and whether at all.

import { element, shown } from "./dom.js";

export class ChoiceForm {
  constructor(form) {
    this.form = form;
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  show(offers, choice) {
    if (this.offers) return; // after a lost connection the form stays as it is
    this.offers = offers;
    this.given = choice;
    this.help = element("input", { type: "checkbox", checked: choice.assisted, id: "assisted" });
    this.select = element("select", { id: "assistant" });
    const names = offers.map((offer) => offer.name);
    if (!names.includes(choice.assistant)) names.unshift(choice.assistant);
    this.select.append(...names.map((name) => new Option(name, name)));
    this.select.value = choice.assistant;
    this.summary = element("p", { className: "quiet" });
    this.fields = element("div", { className: "more" });
    this.select.addEventListener("change", () => this.#showOptions());
    this.form.replaceChildren(
      element("label", { className: "flag" }, this.help, "Help me in the next episode"),
      element("label", {}, "Assistant", this.select),
      this.summary,
      this.fields,
      element("p", { className: "quiet" }, "A change counts from the next episode on."),
    );
    this.#showOptions();
  }

  // As the server takes it.
  get value() {
    const options = {};
    for (const [name, read] of Object.entries(this.readers)) {
      const value = read();
      if (value !== null) options[name] = value;
    }
    return { assistant: this.select.value, options, assisted: this.help.checked };
  }

  #showOptions() {
    const name = this.select.value;
    const offer = this.offers.find((each) => each.name === name);
    const given = name === this.given.assistant ? this.given.options : {};
    this.summary.textContent = offer?.summary ?? "As the command line gave it.";
    this.readers = Object.fromEntries(Object.entries(given).map(([option, value]) => [option, () => value]));
    const made = (offer?.options ?? []).map((option) => {
      const [label, read] = field(option, given[option.name] ?? option.default);
      this.readers[option.name] = read;
      return [option.needed, label];
    });
    const needed = made.filter(([is]) => is).map(([, label]) => label);
    const others = made.filter(([is]) => !is).map(([, label]) => label);
    this.fields.replaceChildren(...needed);
    if (others.length) {
      const more = element("details", { className: "options" }, element("summary", {}, "More options"));
      more.append(element("div", { className: "more" }, ...others));
      this.fields.append(more);
    }
  }
}

// A label with its control, and what reads it.
function field(option, start) {
  const title = option.name.replaceAll("_", " ");
  if (option.kind === "flag") {
    const box = element("input", { type: "checkbox", checked: Boolean(start), name: option.name });
    return [element("label", { className: "flag" }, box, title), () => box.checked];
  }
  if (option.kind === "choice") {
    const known = [...new Set([...option.choices.map((each) => JSON.stringify(each)), JSON.stringify(start)])];
    const select = element("select", { name: option.name });
    select.append(...known.map((text) => new Option(named(JSON.parse(text)), text)));
    select.value = JSON.stringify(start);
    return [element("label", {}, title, select), () => JSON.parse(select.value)];
  }
  const bounded = option.least !== null && option.most !== null && !option.whole && option.needed;
  return bounded ? slider(option, title, start) : number(option, title, start);
}

function named(value) {
  return typeof value === "object" && value ? value.name : String(value);
}

function slider(option, title, start) {
  const range = element("input", {
    type: "range", min: option.least, max: option.most, step: (option.most - option.least) / 100, name: option.name,
  });
  range.value = start;
  const value = element("span", { className: "value" }, shown(start));
  range.addEventListener("input", () => (value.textContent = shown(range.valueAsNumber)));
  return [element("label", {}, element("span", {}, title, value), range), () => range.valueAsNumber];
}

function number(option, title, start) {
  const box = element("input", { type: "number", step: option.whole ? 1 : "any", name: option.name });
  if (option.least !== null) box.min = option.least;
  if (option.most !== null) box.max = option.most;
  if (start !== null && start !== undefined) box.value = start;
  return [element("label", {}, title, box), () => (box.value === "" ? null : box.valueAsNumber)];
}
