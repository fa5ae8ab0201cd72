// Keys, buttons and gamepads: which action is pressed, and which is held.

const GAMEPAD = { 0: "Space", 1: "Enter", 12: "ArrowUp", 13: "ArrowDown", 14: "ArrowLeft", 15: "ArrowRight" };
const ARROWS = { up: "↑", right: "→", down: "↓", left: "←" };

export class Input {
  #down = new Map(); // what is down, in the order in which it was pressed: source -> action

  // pressed(action, device, time) is called at each press; held(action or null, device, time)
  // whenever another action than before is held.
  constructor(surface, pad, pressed, held) {
    Object.assign(this, { surface, pad, pressed, held });
    surface.addEventListener("keydown", (event) => this.#key(event));
    window.addEventListener("keyup", (event) => this.#release(event.code, event.timeStamp));
    window.addEventListener("blur", () => this.releaseAll());
    surface.addEventListener("blur", () => this.releaseAll());
    const poll = (now) => {
      this.#gamepads(now);
      requestAnimationFrame(poll);
    };
    requestAnimationFrame(poll);
  }

  show(task) {
    this.task = task;
    const directions = task.actions.filter((name) => name in ARROWS);
    this.pad.classList.toggle("arrows", directions.length === task.actions.length && directions.length === 4);
    this.pad.replaceChildren(...task.actions.map((name, action) => this.#button(name, action)));
  }

  releaseAll() {
    if (!this.#down.size) return;
    this.#down.clear();
    this.#changed("keyboard", performance.now());
  }

  #key(event) {
    const action = this.task?.keys[event.code];
    if (action === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!event.repeat) this.#press(event.code, action, "keyboard", event.timeStamp);
  }

  #press(source, action, device, time) {
    if (this.#down.has(source)) return;
    this.#down.set(source, action);
    this.pressed(action, device, time);
    this.#changed(device, time);
  }

  #release(source, time, device = "keyboard") {
    if (this.#down.delete(source)) this.#changed(device, time);
  }

  #changed(device, time) {
    const held = [...this.#down.values()].at(-1) ?? null;
    for (const button of this.pad.children) {
      button.classList.toggle("pressed", [...this.#down.values()].includes(Number(button.dataset.action)));
    }
    this.held(held, device, time);
  }

  #button(name, action) {
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.action = action;
    button.className = name;
    const codes = Object.keys(this.task.keys).filter((code) => this.task.keys[code] === action);
    const sign = ARROWS[name] ? `${ARROWS[name]} ` : "";
    button.append(`${sign}${name}`);
    if (codes.length) {
      const hint = document.createElement("small");
      hint.textContent = codes.map(keyName).join(", ");
      button.append(hint);
    }
    const source = `button ${action}`;
    button.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      button.setPointerCapture(event.pointerId);
      this.#press(source, action, "touch", event.timeStamp);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      button.addEventListener(end, (event) => this.#release(source, event.timeStamp, "touch"));
    }
    button.addEventListener("click", (event) => {
      if (event.detail) return; // a pointer, which has been heard
      this.#press(source, action, "keyboard", event.timeStamp);
      setTimeout(() => this.#release(source, performance.now()), 100);
    });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    return button;
  }

  #gamepads(now) {
    if (!this.task || !navigator.getGamepads) return;
    for (const gamepad of navigator.getGamepads()) {
      if (!gamepad) continue;
      const [across = 0, along = 0] = gamepad.axes;
      const stick = { ArrowLeft: across < -0.5, ArrowRight: across > 0.5, ArrowUp: along < -0.5, ArrowDown: along > 0.5 };
      const down = new Set(Object.keys(stick).filter((code) => stick[code]));
      gamepad.buttons.forEach((button, number) => button.pressed && down.add(GAMEPAD[number]));
      for (const code of [...Object.values(GAMEPAD)]) {
        const action = this.task.keys[code];
        const source = `gamepad ${code}`;
        if (action === undefined) continue;
        if (down.has(code)) this.#press(source, action, "gamepad", now);
        else this.#release(source, now, "gamepad");
      }
    }
  }
}

// The first key of each action, in words; nothing for who has no keyboard at hand.
export function keysOf(task) {
  if (matchMedia("(hover: none) and (pointer: coarse)").matches) return "";
  const named = Object.entries(task.keys).filter(([, action], place, all) => all.findIndex((each) => each[1] === action) === place);
  return `Keys: ${named.map(([code, action]) => `${keyName(code)} ${task.actions[action]}`).join(", ")}.`;
}

export function keyName(code) {
  return code.replace(/^(Key|Digit)/, "").replace(/^Arrow(\w+)/, (_, way) => ARROWS[way.toLowerCase()]);
}
