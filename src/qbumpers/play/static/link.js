// The socket: says hello, comes back after it was lost, and remembers which session this is.

const KEY = "qbumpers-session";
const TAKEN_OVER = 4001, UNKNOWN_SESSION = 4004, REFUSED = [4002, 4003, 4005, 4006];

export class Link {
  #socket = null;
  #closing = null;
  #attempts = 0;
  #token = "";

  // hello() says what this device is; heard(message) takes what comes; changed(state, reason) is
  // called with "open", "lost", "taken", "refused" or "renewed".
  constructor(hello, heard, changed) {
    Object.assign(this, { hello, heard, changed });
    try {
      this.#token = localStorage.getItem(KEY) ?? "";
    } catch { /* without storage, a reload begins a new session */ }
  }

  // Whether this browser has been here before.
  get known() {
    return this.#token !== "";
  }

  open() {
    const socket = new WebSocket(`ws${location.protocol === "https:" ? "s" : ""}://${location.host}/socket`);
    this.#socket = socket;
    this.#closing = null;
    socket.onopen = () => this.send({ type: "hello", token: this.#token, ...this.hello() });
    socket.onmessage = (event) => this.#take(JSON.parse(event.data));
    socket.onclose = (event) => socket === this.#socket && this.#lost(event.code);
  }

  send(message) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  #take(message) {
    if (message.type === "closing") {
      this.#closing = message;
      return;
    }
    if (message.type === "welcome") {
      this.#attempts = 0;
      this.#remember(message.token);
      this.changed("open", "");
    }
    this.heard(message);
  }

  #lost(code) {
    const reason = this.#closing?.reason ?? "";
    code = this.#closing?.code ?? code;
    if (code === TAKEN_OVER) return this.changed("taken", reason);
    if (REFUSED.includes(code)) return this.changed("refused", reason);
    if (code === UNKNOWN_SESSION) {
      this.#remember("");
      this.changed("renewed", reason);
      return this.open();
    }
    this.changed("lost", reason);
    const wait = Math.min(4000, 300 * 2 ** this.#attempts++);
    setTimeout(() => this.open(), wait);
  }

  #remember(token) {
    this.#token = token;
    try {
      localStorage.setItem(KEY, token);
    } catch { /* see above */ }
  }
}
