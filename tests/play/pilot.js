// In the page, before anything else: measures what a player feels, and flies as Gymnasium's heuristic
// pilot does, from the shapes that are drawn and by keys that are pressed. As people do, it reckons with
// the delay: it knows what it has pressed, and steers where the lander will be.

window.pilot = (() => {
  const heard = []; // functions that take each state
  const Plain = window.WebSocket;
  window.WebSocket = class extends Plain {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", (event) => {
        const message = JSON.parse(event.data);
        if (message.type === "state") for (const each of [...heard]) each(message);
      });
    }
  };
  let flying = null;
  let last = null;
  heard.push((state) => (last = state));

  const surface = () => document.getElementById("focus");
  const down = (code) => surface().dispatchEvent(new KeyboardEvent("keydown", { code, bubbles: true }));
  const up = (code) => window.dispatchEvent(new KeyboardEvent("keyup", { code }));
  const frames = (then) => requestAnimationFrame(() => requestAnimationFrame(() => then(performance.now())));

  // Presses a key; when its echo and the state that `is` what comes of it are on the screen.
  function felt(code, is) {
    return new Promise((done, failed) => {
      setTimeout(() => failed(new Error(`nothing comes of ${code}`)), 5000);
      const began = performance.now();
      const found = {};
      const finished = () => "echo" in found && "seen" in found && done(found);
      const hear = (state) => {
        if (!is(state)) return;
        heard.splice(heard.indexOf(hear), 1);
        frames((now) => { found.seen = now - began; up(code); finished(); });
      };
      heard.push(hear);
      down(code);
      if (document.querySelector("#pad .pressed")) frames((now) => { found.echo = now - began; finished(); });
    });
  }

  function seen(scene) {
    const hull = scene.find((shape) => shape.colour === "#8066e6" && shape.points.length === 6);
    const [[left, low], [right, high]] = [hull.points[2], hull.points[3]];
    const angle = -Math.atan2(high - low, right - left);
    const mean = [0, 1].map((axis) => hull.points.reduce((sum, point) => sum + point[axis], 0) / 6);
    return {
      x: mean[0] / 300 - 1, y: (400 - mean[1] - 118) / 200, angle,
      legs: scene.some((shape) => shape.colour === "#ffd24a"),
    };
  }

  // Where the lander will be once keys of as many steps have come to something that have not yet.
  function ahead(now, keys) {
    let { x, y, angle, across, along, turning } = now;
    for (const key of keys) {
      along += key === "ArrowUp" ? 0.0205 : -0.0267;
      across += key === "ArrowUp" ? -0.047 * Math.sin(angle) : key === "ArrowLeft" ? -0.01 : key === "ArrowRight" ? 0.01 : 0;
      turning += key === "ArrowLeft" ? 0.039 : key === "ArrowRight" ? -0.039 : 0;
      x += 0.01 * across;
      y += 0.0225 * along;
      angle += 0.05 * turning;
    }
    return { x, y: Math.max(0, y), angle, across, along, turning, legs: now.legs };
  }

  function advised({ x, y, angle, across, along, turning, legs }) {
    if (legs) return null; // it stands
    const wanted = Math.max(-0.4, Math.min(0.4, 0.5 * x + across));
    const turn = 0.5 * (wanted - angle) - turning;
    const rise = 0.5 * (0.05 + 0.55 * Math.abs(x) - y) - 0.5 * along;
    if (rise > Math.abs(turn) && rise > 0.05) return "ArrowUp";
    return turn < -0.05 ? "ArrowRight" : turn > 0.05 ? "ArrowLeft" : null;
  }

  function moving(drawn, before, steps) {
    const speed = (axis) => (drawn[axis] - before[axis]) / (0.02 * steps);
    return { ...drawn, across: 2 * speed("x"), along: 0.889 * speed("y"), turning: 0.4 * speed("angle") };
  }

  return {
    step: (code) => { const before = last.number; return felt(code, (state) => state.number === before + 1); },
    hold: (code, action) => felt(code, (state) => state.last?.proposed === action),
    ended: () => ({ success: last.episode.success, total: last.episode.total }),
    fly(delay) {
      if (flying) heard.splice(heard.indexOf(flying), 1);
      const underway = Math.round(delay / 0.02);
      const keys = [];
      const past = [];
      let held = null;
      flying = (state) => {
        past.push([state.number, seen(state.scene)]);
        if (past.length > 3) past.shift();
        const [[first, before], [number, now]] = [past[0], past.at(-1)];
        if (number === first) return;
        const code = state.episode.over ? null : advised(ahead(moving(now, before, number - first), keys));
        keys.push(code);
        while (keys.length > underway) keys.shift();
        if (code === held) return;
        if (held) up(held);
        if (code) down(code);
        held = code;
      };
      heard.push(flying);
    },
  };
})();
