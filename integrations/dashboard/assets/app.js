// The connection to the robot, and the head of the page. Texts of the robot are set as text alone, never as HTML.
import { Views } from "/views.js";

const find = (id) => document.getElementById(id);
const VERSION = 1;

class App {
  constructor() {
    this.robot = { description: null, report: null, parameters: {}, joints: {}, messages: new Map(), rates: new Map(), rights: [], caller: "" };
    this.waiting = new Map();
    this.next = 1;
    this.history = [];
    this.stat = { frames: 0, messages: 0, drawn: 0, bytes: 0, answers: 0 };
    this.token = takeToken();
    this.retry = 500;
    this.chosen = null;
    this.views = new Views(this);
    this.bindHead();
    this.connect();
    setInterval(() => this.ping(), 2000);
    setInterval(() => this.redraw(), 100);
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`);
    this.socket = socket;
    socket.onopen = () => socket.send(JSON.stringify({ op: "hello", version: VERSION, client: "page", ...(this.token && { token: this.token }), ...(this.chosen && { robot: this.chosen }) }));
    socket.onmessage = (event) => { this.stat.bytes += event.data.length; this.take(JSON.parse(event.data)); };
    socket.onclose = () => {
      if (this.socket !== socket) return;
      for (const { refuse } of this.waiting.values()) refuse(new Error("the connection has ended"));
      this.waiting.clear();
      this.isLive = false;
      find("link").textContent = "lost";
      this.banner(this.fatal ?? "The connection is lost. All values are those of before.", "bad");
      setTimeout(() => this.connect(), this.retry);
      this.retry = Math.min(this.retry * 2, 5000);
    };
  }

  take(message) {
    if (message.op === "welcome") this.welcome(message);
    else if (message.op === "frame") this.frame(message);
    else if (message.op === "answer") {
      const waiting = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      this.stat.answers += 1;
      if (message.error !== undefined) waiting?.refuse(new Error(message.error)); else waiting?.done(message);
    } else if (message.op === "result") this.views.result(message);
    else if (message.op === "error") {
      this.fatal = message.error;
      if (this.token && message.error.includes("token")) this.forget();
    }
  }

  welcome(message) {
    const { description } = message;
    Object.assign(this.robot, { description, rights: message.rights, meshes: message.meshes, caller: message.caller, parameters: Object.fromEntries(description.parameters.map((one) => [one.path, one.value])), messages: new Map(), report: null });
    this.history = [];
    this.isLive = true;
    this.retry = 500;
    this.fatal = undefined;
    this.name = message.robot;
    document.title = message.robot;
    find("robot").textContent = message.robot;
    find("run").textContent = { live: "runs in real time", simulation: "simulation", replay: "replay of a journal" }[description.run] ?? description.run;
    const robots = find("robots");
    robots.hidden = message.robots.length < 2;
    robots.replaceChildren(...message.robots.map((name) => new Option(name, name, false, name === message.robot)));
    if (this.may("arm") || this.may("commands") || this.may("parameters")) this.banner(null);
    else {
      if (this.token) this.forget();
      this.banner("You may read, and disarm the robot. To steer it, open the address with the token that the program has printed.", "act");
    }
    this.views.welcome();
    this.watch();
    this.ping();
    this.head();
  }

  frame(frame) {
    this.stat.frames += 1;
    const { robot } = this;
    if (frame.parameters) robot.parameters = frame.parameters;
    if (frame.joints) robot.joints = frame.joints;
    for (const [path, message] of Object.entries(frame.messages ?? {})) {
      this.stat.messages += 1;
      robot.messages.set(path, message);
      this.views.message(path, message);
    }
    if (frame.lost_events) this.views.lostEvents(frame.lost_events);
    for (const event of frame.events ?? []) this.views.event(event);
    if (frame.report) {
      robot.report = frame.report;
      this.rates(frame.report);
      this.head();
      this.views.report();
    }
    if (frame.parameters) this.views.parameters();
    if (frame.joints) this.views.joints();
  }

  // Messages a second of each topic over the last two seconds or so, counted by the robot.
  rates(report) {
    const now = { time: report.time, counts: new Map(report.topics.map((topic) => [topic.path, topic.published])) };
    if (this.history.at(-1)?.time > now.time) this.history = [];
    this.history.push(now);
    while (this.history.length > 2 && this.history[1].time <= now.time - 2) this.history.shift();
    const first = this.history[0], span = now.time - first.time;
    if (span <= 0) return;
    this.robot.rates = new Map([...now.counts].map(([path, count]) => [path, (count - (first.counts.get(path) ?? 0)) / span]));
  }

  may(right) {
    return this.isLive && this.robot.rights.includes(right);
  }

  // Sends a request; its answer is awaited.
  ask(op, more = {}) {
    if (!this.isLive) return Promise.reject(new Error("the connection is lost"));
    const id = this.next++;
    return new Promise((done, refuse) => {
      this.waiting.set(id, { done, refuse });
      this.socket.send(JSON.stringify({ op, id, ...more }));
    });
  }

  // The same, with a note if it is refused.
  async tell(op, more, what) {
    try {
      return await this.ask(op, more);
    } catch (error) {
      this.toast(`${what}: ${error.message}`, true);
      return null;
    }
  }

  watch() {
    if (this.isLive) this.ask("watch", { paths: this.views.watched() }).catch(() => {});
  }

  async ping() {
    if (!this.isLive) return;
    const start = performance.now(), frames = this.stat.frames;
    try {
      await this.ask("ping");
      const millis = performance.now() - start;
      const rate = this.pinged ? (frames - this.pinged.frames) / (start - this.pinged.start) * 1000 : 0;
      this.pinged = { start, frames };
      find("link").textContent = `${millis.toFixed(millis < 10 ? 1 : 0)} ms`;
      find("link").title = `${rate.toFixed(1)} frames a second`;
    } catch { /* The connection says so itself. */ }
  }

  head() {
    const { report } = this.robot;
    const pill = (id, text, kind) => { find(id).textContent = text; find(id).className = `pill ${kind}`; };
    const arm = find("arm"), disarm = find("disarm");
    if (report) {
      pill("safety", report.safety, { armed: "act", error: "bad", disarming: "warn" }[report.safety] ?? "");
      pill("state", report.state, "");
      find("time").textContent = clock(report.time);
    }
    const isError = report?.safety === "error";
    arm.textContent = isError ? "Force disarm" : "Arm";
    arm.title = isError ? "Leaves the state error, although something may not be safe" : "";
    arm.disabled = !this.may("arm") || !(isError || report?.safety === "disarmed");
    disarm.disabled = !this.isLive;
  }

  bindHead() {
    find("arm").onclick = () => {
      const isError = this.robot.report?.safety === "error";
      if (isError && !confirm("Leave the state error although something may not be safe?")) return;
      this.tell(isError ? "force_disarm" : "arm", {}, isError ? "Not disarmed" : "Not armed");
    };
    find("disarm").onclick = () => this.tell("disarm", {}, "Not disarmed");
    find("robots").onchange = (event) => { this.chosen = event.target.value; this.socket.close(); };
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const paint = () => { document.documentElement.dataset.scheme = this.scheme ?? (dark.matches ? "dark" : "light"); };
    dark.onchange = paint;
    this.scheme = localStorage.getItem("scheme") ?? undefined;
    paint();
    find("scheme").onclick = () => {
      this.scheme = document.documentElement.dataset.scheme === "dark" ? "light" : "dark";
      localStorage.setItem("scheme", this.scheme);
      paint();
    };
    const tabs = [...document.querySelectorAll("[role=tab]")];
    const show = (tab, focus) => {
      for (const other of tabs) {
        const isShown = other === tab;
        other.setAttribute("aria-selected", isShown);
        other.tabIndex = isShown ? 0 : -1;
        find(other.getAttribute("aria-controls")).hidden = !isShown;
      }
      if (focus) tab.focus();
      tab.scrollIntoView({ block: "nearest", inline: "nearest" });
      this.views.shown(tab.getAttribute("aria-controls"));
    };
    tabs.forEach((tab, index) => {
      tab.onclick = () => show(tab);
      tab.onkeydown = (event) => {
        const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
        if (step) show(tabs[(index + step + tabs.length) % tabs.length], true);
      };
    });
    let escaped = -Infinity;
    document.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && !event.repeat) {
        if (event.timeStamp - escaped < 600) this.tell("disarm", {}, "Not disarmed");
        escaped = event.timeStamp;
      }
      if (event.target.matches("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey) return;
      const tab = tabs[Number(event.key) - 1];
      if (tab) show(tab, true);
    });
  }

  banner(text, kind) {
    const banner = find("banner");
    banner.hidden = !text;
    banner.className = kind ?? "";
    banner.textContent = text ?? "";
    this.head();
  }

  toast(text, isRefused) {
    const toast = document.createElement("div");
    toast.className = isRefused ? "toast refused" : "toast";
    toast.textContent = text;
    find("toasts").append(toast);
    while (find("toasts").children.length > 4) find("toasts").firstChild.remove();
    setTimeout(() => toast.remove(), isRefused ? 8000 : 4000);
  }

  forget() {
    this.token = null;
    sessionStorage.removeItem("token");
  }

  redraw() {
    if (!document.hidden) this.stat.drawn += this.views.redraw();
  }
}

// The token of the address, which it does not stay in.
function takeToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token) {
    sessionStorage.setItem("token", token);
    history.replaceState(null, "", location.pathname);
  }
  return token ?? sessionStorage.getItem("token");
}

export function clock(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const whole = Math.floor(seconds), pad = (number) => String(number).padStart(2, "0");
  return whole < 3600 ? `${Math.floor(whole / 60)}:${pad(whole % 60)}` : `${Math.floor(whole / 3600)}:${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)}`;
}

window.dashboard = new App();
