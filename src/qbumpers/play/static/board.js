// The canvas: draws shapes, and moves them smoothly from one scene to the next.

const STILL = matchMedia("(prefers-reduced-motion: reduce)");

export class Board {
  #backdrop = document.createElement("canvas");
  #before = [];
  #now = [];
  #began = 0;
  #lasts = 0;
  #waiting = [];

  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    new ResizeObserver(() => this.#fit()).observe(canvas);
    const frame = (now) => {
      if (this.task && this.#dirty) this.#paint(now);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  show(task) {
    this.task = task;
    this.canvas.width = task.width;
    this.canvas.height = task.height;
    this.#fit();
  }

  // Draws a scene over `lasts` milliseconds; `drawn(time)` is called when it is first on the screen.
  draw(scene, lasts, drawn) {
    this.#before = this.#at(performance.now());
    this.#now = scene;
    this.#began = performance.now();
    this.#lasts = STILL.matches || this.#leaps() ? 0 : lasts;
    this.#waiting.push(drawn);
    this.#dirty = true;
  }

  #dirty = false;

  #fit() {
    if (!this.task) return;
    const scale = Math.max(1, (this.canvas.clientWidth * devicePixelRatio) / this.task.width);
    this.scale = Math.min(scale, 4);
    for (const canvas of [this.canvas, this.#backdrop]) {
      canvas.width = Math.round(this.task.width * this.scale);
      canvas.height = Math.round(this.task.height * this.scale);
    }
    paint(this.#backdrop.getContext("2d"), this.task.backdrop, this.scale);
    this.#dirty = true;
  }

  #paint(now) {
    this.context.setTransform(1, 0, 0, 1, 0, 0);
    this.context.drawImage(this.#backdrop, 0, 0);
    paint(this.context, this.#at(now), this.scale);
    this.#dirty = now < this.#began + this.#lasts;
    const waiting = this.#waiting.splice(0);
    for (const drawn of waiting) drawn(now);
  }

  // Whether something goes so far that it is no movement.
  #leaps() {
    const far = Math.max(this.task.width, this.task.height) / 4;
    return !alike(this.#before, this.#now) || this.#now.some((shape, s) =>
      shape.points.some(([x, y], p) => {
        const [fromX, fromY] = this.#before[s].points[p];
        return Math.hypot(x - fromX, y - fromY) > far;
      }));
  }

  #at(now) {
    const share = this.#lasts ? Math.min(1, Math.max(0, now - this.#began) / this.#lasts) : 1;
    if (share === 1) return this.#now;
    return this.#now.map((shape, s) => ({
      ...shape,
      points: shape.points.map(([x, y], p) => {
        const [fromX, fromY] = this.#before[s].points[p];
        return [fromX + (x - fromX) * share, fromY + (y - fromY) * share];
      }),
    }));
  }
}

function alike(some, others) {
  return some.length === others.length && some.every((shape, s) =>
    shape.kind === others[s].kind && shape.points.length === others[s].points.length);
}

function paint(context, shapes, scale) {
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.lineJoin = "round";
  for (const shape of shapes) DRAW[shape.kind](context, shape);
}

const DRAW = {
  polygon(context, shape) {
    trace(context, shape.points);
    context.closePath();
    fill(context, shape);
  },
  circle(context, shape) {
    context.beginPath();
    context.arc(...shape.points[0], shape.size, 0, 2 * Math.PI);
    fill(context, shape);
  },
  line(context, shape) {
    trace(context, shape.points);
    context.strokeStyle = shape.colour;
    context.lineWidth = shape.width;
    context.stroke();
  },
  text(context, shape) {
    context.font = `${shape.size}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = shape.colour;
    context.fillText(shape.text, ...shape.points[0]);
  },
};

function trace(context, points) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
}

function fill(context, shape) {
  context.fillStyle = shape.colour;
  context.fill();
  if (!shape.outline) return;
  context.strokeStyle = shape.outline;
  context.lineWidth = shape.width;
  context.stroke();
}
