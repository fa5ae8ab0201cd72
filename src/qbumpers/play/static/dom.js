// Elements and numbers.

export const byId = (id) => document.getElementById(id);

export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

export function shown(number) {
  if (number === null || number === undefined) return "–";
  const size = Math.abs(number);
  const text = number.toFixed(size >= 100 || Number.isInteger(number) ? 0 : size >= 1 ? 1 : 2);
  return text.replace("-", "−").replace(/^−(0(\.0+)?)$/, "$1");
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
