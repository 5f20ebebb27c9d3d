// The parts of the page. Each keeps its elements and changes their texts, so that what somebody types or selects stays.
import { COLOURS, Plot } from "/plot.js";

const find = (id) => document.getElementById(id);
const COLOUR = { unsafe: "bad", stopped: "bad", lost: "bad", degraded: "warn", refused: "act", healthy: "good" };
const KEPT_EVENTS = 1000;

// An element with a class, texts or children, and other properties.
function make(kind, name, ...children) {
  const element = document.createElement(kind);
  if (name) element.className = name;
  element.append(...children);
  return element;
}

// Changes a text only if it differs, so that a selection stays.
function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// A path, which may be broken after its slashes.
function setPath(element, path) {
  if (element.textContent === path) return;
  element.replaceChildren(...path.split("/").flatMap((name, index) => index ? ["/", document.createElement("wbr"), name] : [name]));
}

// One child for each item, made once for each key.
function reconcile(container, items, key, create, update) {
  const kept = container.kept ??= new Map(), used = new Set();
  items.forEach((item, index) => {
    const name = key(item);
    let child = kept.get(name);
    if (!child) kept.set(name, child = create(item));
    used.add(name);
    update?.(child, item);
    if (container.children[index] !== child) container.insertBefore(child, container.children[index] ?? null);
  });
  for (const [name, child] of kept) if (!used.has(name)) { child.remove(); kept.delete(name); }
}

function ago(seconds) {
  if (!Number.isFinite(seconds)) return "";
  if (seconds < 0.95) return "just now";
  if (seconds < 60) return `for ${seconds.toFixed(0)} s`;
  if (seconds < 3600) return `for ${Math.floor(seconds / 60)} min ${Math.floor(seconds % 60)} s`;
  return `for ${Math.floor(seconds / 3600)} h ${Math.floor(seconds / 60 % 60)} min`;
}

function short(number) {
  if (typeof number !== "number") return String(number);
  if (Number.isInteger(number)) return String(number);
  const size = Math.abs(number);
  return size >= 1e6 || size < 1e-4 ? number.toExponential(3) : String(Number(number.toPrecision(5)));
}

function duration(seconds) {
  if (seconds === undefined || seconds === null) return "–";
  if (seconds < 1e-3) return `${(seconds * 1e6).toFixed(0)} µs`;
  return seconds < 1 ? `${(seconds * 1e3).toFixed(1)} ms` : `${seconds.toFixed(2)} s`;
}

// The numbers in a payload, each with its path: `position.x`.
function numbers(value, path = "", all = []) {
  if (all.length >= 200) return all;
  if (typeof value === "number" || typeof value === "boolean") all.push([path || "value", Number(value)]);
  else if (value && typeof value === "object") for (const [name, part] of Object.entries(value)) numbers(part, path ? `${path}.${name}` : name, all);
  return all;
}

// 14:05:09.250; empty for an event that was too long to be sent.
function dayTime(date) {
  if (Number.isNaN(date.getTime())) return "";
  const two = (number) => String(number).padStart(2, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${String(date.getMilliseconds()).padStart(3, "0")}`;
}

export class Views {
  constructor(app) {
    this.app = app;
    this.plots = [];
    this.span = 30;
    this.events = [];
    this.lost = 0;
    this.view = "overview";
    this.bindPlots();
    this.bindTopics();
    this.bindEvents();
    find("scene-reset").onclick = () => this.scene?.reset();
    new MutationObserver(() => this.scene?.paint()).observe(document.documentElement, { attributeFilter: ["data-scheme"] });
  }

  get robot() { return this.app.robot; }

  welcome() {
    for (const id of ["problems", "health", "executions", "commands", "parameters", "joint-list"]) {
      find(id).kept = undefined;
      find(id).replaceChildren();
    }
    find("topic-table").tBodies[0].kept = undefined;
    find("topic-table").tBodies[0].replaceChildren();
    this.buildCommands();
    this.buildParameters();
    this.buildJoints();
    this.buildGraph();
    this.buildPlace();
    const topics = this.robot.description.topics.map((topic) => topic.path).filter((path) => !/^(param|command)\/|^journal$/.test(path)).sort();
    const chosen = find("plot-topic").value;
    find("plot-topic").replaceChildren(...topics.map((path) => new Option(path, path, false, path === chosen)));
    this.fields();
  }

  shown(view) {
    this.view = view;
    if (view === "plots" || view === "topics" || view === "scene") this.app.watch();
    if (view === "scene") this.showScene();
    if (this.robot.report) this.report();
    if (view === "events") this.drawEvents();
  }

  watched() {
    const paths = new Set(this.plots.map((plot) => plot.path));
    if (find("plot-topic").value && this.view === "plots") paths.add(find("plot-topic").value);
    if (this.topic && this.view === "topics") paths.add(this.topic);
    if (this.placedBy && this.view === "scene") paths.add(this.placedBy);
    return [...paths];
  }

  report() {
    const { report } = this.robot;
    this.problems(report);
    this.health(report);
    this.executions(report);
    if (this.view === "topics") this.topics(report);
    if (this.view === "graph") this.paintGraph(report);
  }

  // ---- What is wrong

  problems(report) {
    const box = find("problems"), { problems } = report;
    if (problems.length === 0) {
      box.kept = undefined;
      if (!box.querySelector(".none")) box.replaceChildren(make("p", "none", "Nothing."));
      return;
    }
    box.querySelector(".none")?.remove();
    reconcile(box, problems, (one) => `${one.severity} ${one.path}`, () => {
      const line = make("div", "line", make("span", "pill"), make("span", "path"), make("span", "since"), make("p", "reason"));
      return line;
    }, (line, one) => {
      const [pill, path, since, reason] = line.children;
      pill.className = `pill ${COLOUR[one.severity] ?? ""}`;
      set(pill, one.severity);
      setPath(path, one.path);
      set(since, one.since === null ? "" : ago(report.time - one.since));
      set(reason, one.reason);
    });
  }

  health(report) {
    const box = find("health");
    const estimators = report.estimators.filter((one) => one.health !== null);
    if (estimators.length === 0) {
      if (!box.querySelector(".empty")) box.replaceChildren(make("p", "empty", "The robot has no estimators."));
      return;
    }
    reconcile(box, estimators, (one) => one.path, () => make("div", "line", make("span", "pill"), make("span", "path"), make("span", "since"), make("p", "reason")), (line, one) => {
      const [pill, path, since, reason] = line.children;
      pill.className = `pill ${one.stopped ? "bad" : COLOUR[one.health]}`;
      set(pill, one.stopped ? "stopped" : one.health);
      setPath(path, one.path);
      set(since, ago(report.time - (one.since ?? 0)));
      const rate = this.robot.rates.get(one.path);
      const dropped = one.inputs.flatMap((input) => Object.entries(input.dropped).map(([why, count]) => `${count} of ${input.name} dropped: ${why}`));
      const parts = [one.health === "healthy" ? null : one.reason, rate === undefined ? null : `${short(Number(rate.toFixed(1)))} Hz`, one.latency ? `p99 ${duration(one.latency.p99)}` : null, ...dropped];
      set(reason, parts.filter(Boolean).join(" · "));
    });
  }

  // ---- Commands

  executions(report) {
    const limits = new Map(this.robot.description.commands.map((command) => [command.path, command.timeout_s]));
    reconcile(find("executions"), report.executions, (one) => one.number, (one) => {
      const cancel = make("button", "quiet", "Cancel");
      cancel.type = "button";
      cancel.disabled = !this.app.may("commands");
      cancel.onclick = () => this.app.tell("cancel", { execution: one.number }, "Not cancelled");
      const bar = make("div", "progress", make("i"));
      const line = make("div", "line execution", make("span", "pill act", `no. ${one.number}`), make("span", "path", one.path), cancel, make("p", "reason"), bar);
      return line;
    }, (line, one) => {
      const elapsed = report.time - one.started, limit = limits.get(one.path);
      const progress = numbers(one.progress ?? {}), said = progress.map(([name, value]) => ` · ${name} ${short(value)}`).join("");
      set(line.children[3], `runs ${ago(elapsed)}${limit ? ` of at most ${limit} s` : ""}, started by ${one.caller}${said}`);
      // One number from 0 to 1 is a share.
      const share = progress.length === 1 && progress[0][1] >= 0 && progress[0][1] <= 1 ? progress[0][1] : null;
      line.children[4].classList.toggle("known", share !== null);
      line.children[4].firstChild.style.width = share === null ? "" : `${share * 100}%`;
    });
  }

  buildCommands() {
    const box = find("commands"), { commands } = this.robot.description;
    if (commands.length === 0) return box.append(make("p", "empty", "The robot has no commands."));
    for (const command of commands) {
      const start = make("button", "", "Start");
      start.disabled = !this.app.may("commands") || (command.role === "arming" && !this.app.may("arm"));
      const roles = { arming: "in disarmed", disarming: "in all but disarmed" };
      const states = command.allowed_states ? `in ${command.allowed_states.join(", ") || "no state"}` : roles[command.role] || "in idle";
      const fields = make("div", "fields"), error = make("p", "error");
      const read = form(command.arguments, command.defaults, fields);
      const body = make("form", "", make("div", "head", make("div", "", make("span", "path", command.path.replace(/^command\//, "")), make("p", "note", states)), start), fields, error);
      body.dataset.command = command.path;
      if (!fields.children.length) fields.remove();
      body.onsubmit = async (event) => {
        event.preventDefault();
        set(error, "");
        try {
          const argument = read();
          const answer = await this.app.ask("start", argument === undefined ? { path: command.path } : { path: command.path, arguments: argument });
          this.started.set(answer.execution, { path: command.path, error });
        } catch (refused) {
          set(error, refused.message);
        }
      };
      box.append(make("div", "command", body));
    }
  }

  started = new Map();

  result(message) {
    const started = this.started.get(message.execution);
    this.started.delete(message.execution);
    if (!started) return;
    const isEmpty = message.value === null || message.value === undefined || JSON.stringify(message.value) === "{}";
    if (message.error !== undefined) set(started.error, message.error);
    else this.app.toast(`${started.path.replace(/^command\//, "")} is done${isEmpty ? "" : `: ${JSON.stringify(message.value)}`}`);
  }

  // ---- Parameters

  buildParameters() {
    const box = find("parameters"), { parameters } = this.robot.description;
    this.controls = new Map();
    if (parameters.length === 0) return box.append(make("p", "empty", "The robot has no parameters."));
    for (const parameter of parameters) {
      const name = parameter.path.replace(/^param\//, "");
      const value = make("span", "value"), error = make("p", "error"), control = make("div", "control");
      const box2 = make("div", "parameter", make("div", "head", make("div", "", make("span", "path", name), make("p", "note", parameter.doc)), value), control, error);
      box2.dataset.parameter = parameter.path;
      const inputs = [];
      const input = (type) => {
        const element = make("input");
        element.type = type;
        element.setAttribute("aria-label", name);
        element.disabled = !this.app.may("parameters");
        inputs.push(element);
        control.append(element);
        return element;
      };
      const isNumber = parameter.type === "f64" || parameter.type === "i64";
      const hasRange = isNumber && parameter.minimum !== null && parameter.maximum !== null;
      const step = parameter.type === "i64" ? 1 : "any";
      // One request at a time, then the newest value: a slider gives many.
      let next, isBusy = false, isEdited = false;
      const send = async (wanted) => {
        next = wanted;
        if (isBusy) return;
        isBusy = true;
        while (next !== undefined) {
          const sent = next;
          next = undefined;
          try {
            await this.app.ask("set", { values: { [parameter.path]: sent } });
            // Its frame comes later; until then the old value would be shown again.
            this.robot.parameters[parameter.path] = sent;
            set(error, "");
          } catch (refused) {
            set(error, refused.message);
          }
        }
        isBusy = false;
        isEdited = false;
        show(this.robot.parameters[parameter.path]);
      };
      const show = (current) => {
        const degrees = parameter.unit === "rad" && typeof current === "number" ? ` (${short(Number((current * 180 / Math.PI).toFixed(2)))}°)` : "";
        set(value, `${short(current)}${parameter.unit ? ` ${parameter.unit}` : ""}${degrees}`);
        if (isBusy || isEdited) return;
        for (const element of inputs) {
          if (element.type === "checkbox") element.checked = current === true;
          else if (element.value !== String(current)) element.value = element.type === "number" ? short(current) : String(current);
        }
      };
      if (parameter.type === "bool") {
        control.classList.add("single");
        const box3 = input("checkbox");
        box3.onchange = () => send(box3.checked);
      } else if (isNumber) {
        if (hasRange) {
          const slider = input("range");
          slider.min = parameter.minimum;
          slider.max = parameter.maximum;
          slider.step = parameter.type === "i64" ? 1 : (parameter.maximum - parameter.minimum) / 1000;
          slider.oninput = () => { isEdited = true; inputs[1].value = short(Number(slider.value)); send(Number(slider.value)); };
        } else control.classList.add("single");
        const number = input("number");
        number.step = step;
        number.oninput = () => { isEdited = true; };
        number.onchange = () => { if (number.value === "") { isEdited = false; show(this.robot.parameters[parameter.path]); } else send(Number(number.value)); };
      } else {
        control.classList.add("single");
        const text = input("text");
        text.oninput = () => { isEdited = true; };
        text.onchange = () => send(text.value);
      }
      this.controls.set(parameter.path, show);
      show(parameter.value);
      box.append(box2);
    }
  }

  parameters() {
    for (const [path, show] of this.controls) show(this.robot.parameters[path]);
  }

  // ---- Plots

  bindPlots() {
    find("plot-topic").onchange = () => { this.fields(); this.app.watch(); };
    find("plot-span").onchange = (event) => { this.span = Number(event.target.value); };
    find("plot-pause").onclick = (event) => {
      this.isPaused = !this.isPaused;
      event.target.setAttribute("aria-pressed", this.isPaused);
    };
    find("plot-form").onsubmit = (event) => {
      event.preventDefault();
      const path = find("plot-topic").value, group = find("plot-field").value;
      if (path && group) this.addPlot(path, JSON.parse(group));
    };
  }

  // The numbers of the chosen topic, alone and in groups such as the axes of a vector.
  fields() {
    const select = find("plot-field"), message = this.robot.messages.get(find("plot-topic").value);
    const names = message?.payload === undefined ? [] : numbers(message.payload).map(([name]) => name);
    const groups = new Map();
    for (const name of names) {
      const parent = name.includes(".") ? name.slice(0, name.lastIndexOf(".")) : "";
      groups.set(parent, [...groups.get(parent) ?? [], name]);
    }
    const options = [...groups].filter(([parent, group]) => parent && group.length > 1 && group.length <= 4).map(([parent, group]) => [`${parent} (${group.length})`, group]);
    options.push(...names.map((name) => [name, [name]]));
    const wanted = JSON.stringify(options);
    if (select.dataset.options === wanted && select.options.length) return;
    select.dataset.options = wanted;
    select.replaceChildren(...(options.length ? options.map(([label, group]) => new Option(label, JSON.stringify(group))) : [new Option("no message yet", "")]));
  }

  addPlot(path, names) {
    const canvas = make("canvas"), remove = make("button", "quiet", "Remove");
    const keys = names.map((name, index) => {
      const value = make("b"), key = make("span", "key", `${name} `, value);
      key.style.setProperty("--ink", `var(${COLOURS[index % COLOURS.length]})`);
      return { key, value };
    });
    remove.type = "button";
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${path}: ${names.join(", ")}`);
    const box = make("div", "plot", make("div", "head", make("span", "path", path), ...keys.map(({ key }) => key), remove), canvas);
    const plot = { path, names, values: keys.map(({ value }) => value), plot: new Plot(canvas, names) };
    remove.onclick = () => { this.plots = this.plots.filter((other) => other !== plot); box.remove(); this.app.watch(); };
    this.plots.push(plot);
    find("plot-list").append(box);
    this.app.watch();
  }

  message(path, message) {
    if (path === find("plot-topic").value) this.fields();
    if (path === this.topic) this.showMessage(message);
    if (path === this.placedBy) this.place(message);
    if (this.isPaused || message.payload === undefined) return;
    for (const plot of this.plots.filter((plot) => plot.path === path)) {
      const found = new Map(numbers(message.payload));
      plot.plot.add(message.monotonic_time / 1e9, plot.names.map((name) => found.get(name) ?? null), 120);
    }
  }

  redraw() {
    if (this.view !== "plots" || this.isPaused) return 0;
    for (const plot of this.plots) {
      plot.plot.draw(this.span);
      plot.values.forEach((value, index) => set(value, short(plot.plot.points.at(-1)?.values[index] ?? "–")));
    }
    return this.plots.length ? 1 : 0;
  }

  // ---- Joints

  buildJoints() {
    const box = find("joint-list"), moving = this.robot.description.joints.filter((joint) => joint.kind !== "fixed");
    this.tiles = new Map();
    if (moving.length === 0) return box.append(make("p", "empty", "The robot has no moving joints."));
    for (const joint of moving) {
      const value = make("span", "value"), error = make("p", "error");
      const tile = make("section", "card", make("h2", "", joint.name), value, make("p", "note", [joint.kind, joint.mimics ? `mimics ${joint.mimics}` : "", ...joint.actuators].filter(Boolean).join(" · ")));
      const unit = joint.kind === "prismatic" ? "m" : "rad";
      const low = joint.limit?.lower ?? -Math.PI, high = joint.limit?.upper ?? Math.PI;
      const measured = make("input");
      Object.assign(measured, { type: "range", min: low, max: high, step: "any", disabled: true });
      measured.setAttribute("aria-label", `${joint.name}, measured`);
      tile.append(measured);
      let target = null, isTouched = false;
      const actuator = joint.actuators.map((path) => this.robot.description.components.find((one) => one.path === path)).find((one) => one && position(one.command, 0) !== undefined);
      if (actuator) {
        const slider = make("input"), wanted = make("span", "value", "–");
        target = slider;
        Object.assign(slider, { type: "range", min: low, max: high, step: (high - low) / 500, value: 0, disabled: !this.app.may("actuators") });
        slider.setAttribute("aria-label", `${joint.name}, target`);
        let next, isBusy = false;
        slider.oninput = async () => {
          next = Number(slider.value);
          isTouched = true;
          set(wanted, `${short(next)} ${unit}`);
          if (isBusy) return;
          isBusy = true;
          while (next !== undefined) {
            const sent = next;
            next = undefined;
            try {
              await this.app.ask("send", { path: actuator.path, command: position(actuator.command, sent) });
              set(error, "");
            } catch (refused) {
              set(error, refused.message);
            }
          }
          isBusy = false;
        };
        tile.append(make("label", "", "Target", slider), wanted, error);
      }
      this.tiles.set(joint.name, (state) => {
        const at = state?.position[0];
        // Whoever moves the target first moves it from where the joint is.
        if (target && !isTouched && at !== undefined) target.value = at;
        const degrees = unit === "rad" && at !== undefined ? ` (${short(Number((at * 180 / Math.PI).toFixed(1)))}°)` : "";
        set(value, at === undefined ? "unknown" : `${short(at)} ${unit}${degrees}${state.stale ? ", stale" : ""}`);
        value.className = `value ${state?.stale ? "error" : ""}`;
        measured.value = at ?? low;
      });
      box.append(tile);
    }
  }

  joints() {
    for (const [name, show] of this.tiles) show(this.robot.joints[name]);
    if (this.view === "scene") this.scene?.move(this.robot.joints);
  }

  // ---- 3D

  // The topic that places the root link in the world: one of poses, else of orientations.
  buildPlace() {
    const { components, links, topics } = this.robot.description, root = links.find((link) => link.parent_joint === null)?.name;
    const isOfRoot = (path) => components.some((one) => one.frame === root && (one.path === path || one.topics.includes(path)));
    const by = (payloads) => topics.find((topic) => payloads.includes(topic.payload) && isOfRoot(topic.path))?.path;
    this.placedBy = by(["Pose", "PoseWithCovariance", "Odometry"]) ?? by(["Orientation"]);
    this.scene?.dispose();
    this.scene = null;
    set(find("scene-note"), this.placedBy ? `Placed by ${this.placedBy}. Drag to turn, scroll to come closer.` : "Drag to turn, scroll to come closer.");
    if (this.view === "scene") this.showScene();
  }

  async showScene() {
    const { description } = this.robot;
    if (this.scene || !description) return;
    try {
      // Half a megabyte, which others need not load.
      const { RobotScene } = await import("/scene.js");
      if (this.scene || description !== this.robot.description) return;
      this.scene = new RobotScene(find("scene-box"), description, (file) => this.mesh(file));
      this.scene.move(this.robot.joints);
    } catch (error) {
      find("scene-box").replaceChildren(make("p", "empty", `It cannot be drawn: ${error.message}`));
    }
  }

  // The bytes of a mesh that the robot names; nothing if it is not served.
  async mesh(file) {
    const address = this.robot.meshes[file], { token } = this.app;
    if (!address) return null;
    const answer = await fetch(address, token ? { headers: { authorization: `Bearer ${token}` } } : {});
    if (!answer.ok) throw new Error(await answer.text());
    return answer.arrayBuffer();
  }

  place({ payload }) {
    const pose = payload?.pose ?? payload, at = pose?.position ?? { x: 0, y: 0, z: 0 }, turn = pose?.world_from_body;
    const numbers = turn && [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w];
    // Others are texts: NaN is not a number of JSON.
    if (numbers?.every(Number.isFinite)) this.scene?.place({ xyz: numbers.slice(0, 3), quaternion: numbers.slice(3) });
  }

  // ---- Topics

  bindTopics() {
    find("topic-filter").oninput = () => this.robot.report && this.topics(this.robot.report);
  }

  topics(report) {
    const filter = find("topic-filter").value.trim().toLowerCase();
    const shown = report.topics.filter((topic) => `${topic.path} ${topic.payload}`.toLowerCase().includes(filter));
    reconcile(find("topic-table").tBodies[0], shown, (one) => one.path, (one) => {
      const row = make("tr", "", make("td", "path"), make("td", "", one.payload), make("td", "right"), make("td", "right"), make("td", "right"));
      setPath(row.firstChild, one.path);
      row.tabIndex = 0;
      row.onclick = () => this.choose(one.path);
      row.onkeydown = (event) => { if (event.key === "Enter") this.choose(one.path); };
      return row;
    }, (row, one) => {
      const rate = this.robot.rates.get(one.path) ?? 0;
      row.setAttribute("aria-selected", one.path === this.topic);
      set(row.children[2], `${rate >= 100 ? rate.toFixed(0) : rate.toFixed(1)} Hz`);
      set(row.children[3], String(one.published));
      set(row.children[4], one.lost ? String(one.lost) : "");
    });
  }

  choose(path) {
    this.topic = this.topic === path ? null : path;
    find("message-card").hidden = !this.topic;
    set(find("message-path"), path);
    set(find("message"), "no message yet");
    const known = this.topic && this.robot.messages.get(path);
    if (known) this.showMessage(known);
    this.topics(this.robot.report);
    this.app.watch();
  }

  showMessage(message) {
    const text = message.too_long ? `The message is too long to be shown: ${message.too_long} bytes as JSON.` : JSON.stringify(message.payload, null, 2);
    set(find("message"), text.length > 20000 ? `${text.slice(0, 20000)}\n…` : text);
  }

  // ---- Events

  bindEvents() {
    find("event-filter").oninput = () => this.drawEvents();
    find("event-pause").onclick = (event) => {
      this.isHeld = !this.isHeld;
      event.target.setAttribute("aria-pressed", this.isHeld);
      this.drawEvents();
    };
    find("event-clear").onclick = () => { this.events = []; this.lost = 0; this.lostEvents(0); this.drawEvents(); };
  }

  event(event) {
    this.events.push({ ...describe(event), time: event.message.monotonic_time / 1e9, date: new Date(event.message.wall_time / 1e6), number: this.counted++ });
    if (this.events.length > KEPT_EVENTS) this.events.shift();
    if (this.view === "events") this.drawEvents();
  }

  counted = 0;

  lostEvents(count) {
    this.lost += count;
    find("event-lost").hidden = this.lost === 0;
    set(find("event-lost"), `${this.lost} events are not kept any more.`);
  }

  drawEvents() {
    if (this.isHeld) return;
    const filter = find("event-filter").value.trim().toLowerCase();
    const shown = this.events.filter((event) => `${event.kind} ${event.text}`.toLowerCase().includes(filter)).slice(-300).reverse();
    reconcile(find("event-list"), shown, (event) => event.number, (event) => {
      // The time of day, as clocks on the wall and other logs have it; the robot's own is a hint.
      const time = make("time", "", dayTime(event.date));
      if (time.textContent) time.title = `${event.date.toISOString()}, ${event.time.toFixed(3)} s of the robot's clock`;
      return make("li", "", time, make("span", `pill ${event.colour}`, event.kind), make("p", "", event.text));
    });
  }

  // ---- Graph

  buildGraph() {
    const { components } = this.robot.description, box = find("graph-box");
    const of = new Map();
    for (const component of components) for (const topic of [component.path, ...component.topics]) of.set(topic, component);
    const depth = new Map(), level = (component, seen = new Set()) => {
      if (depth.has(component)) return depth.get(component);
      if (seen.has(component)) return 0;
      seen.add(component);
      const before = component.inputs.map((input) => of.get(input.source)).filter(Boolean).map((source) => level(source, seen) + 1);
      const own = Math.max(component.kind === "actuator" || component.kind === "bridge" || component.kind === "controller" ? 1 : 0, ...before);
      depth.set(component, own);
      return own;
    };
    components.forEach((component) => level(component));
    const columns = [];
    for (const component of components) (columns[depth.get(component)] ??= []).push(component);
    const longest = Math.max(10, ...components.map((component) => component.path.length));
    const width = longest * 7.2 + 28, high = 52, gapX = 64, gapY = 20;
    const element = (kind, attributes, text) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
      for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
      if (text !== undefined) made.textContent = text;
      return made;
    };
    const rows = Math.max(1, ...columns.map((column) => column?.length ?? 0));
    const total = { width: columns.length * (width + gapX) - gapX + 48, height: rows * (high + gapY) - gapY + 48 };
    const svg = element("svg", { class: "graph", width: total.width, height: total.height, viewBox: `0 0 ${total.width} ${total.height}`, role: "img", "aria-label": "Components and what they take" });
    const places = new Map();
    columns.forEach((column, x) => column?.forEach((component, y) => places.set(component, { x: 24 + x * (width + gapX), y: 24 + y * (high + gapY) + (rows - column.length) * (high + gapY) / 2 })));
    for (const component of components) for (const input of component.inputs) {
      const from = places.get(of.get(input.source)), to = places.get(component);
      if (!from || !to) continue;
      const [x1, y1, x2, y2] = [from.x + width, from.y + high / 2, to.x, to.y + high / 2], middle = (x1 + x2) / 2;
      svg.append(element("path", { d: `M${x1} ${y1}C${middle} ${y1} ${middle} ${y2} ${x2} ${y2}`, class: input.driver ? "" : "weak" }));
    }
    this.nodes = new Map();
    for (const [component, { x, y }] of places) {
      const node = element("g", {});
      node.append(element("rect", { x, y, width, height: high, rx: 8 }), element("text", { x: x + 14, y: y + 22 }, component.path), element("text", { x: x + 14, y: y + 40, class: "kind" }, component.kind + (component.rate_hz ? ` · ${short(component.rate_hz)} Hz` : "")));
      svg.append(node);
      this.nodes.set(component.path, node);
    }
    box.replaceChildren(components.length ? svg : make("p", "empty", "The robot has no components."));
  }

  paintGraph(report) {
    const worst = new Map(report.problems.toReversed().map((problem) => [problem.path, COLOUR[problem.severity]]));
    for (const [path, node] of this.nodes) node.setAttribute("class", `node-${worst.get(path) ?? "good"}`);
  }
}

// The command of an actuator that moves its joint there, if its schema says how.
function position(schema, target) {
  if (!schema) return undefined;
  if (schema.type === "number" || schema.anyOf?.some((one) => one.type === "number")) return target;
  if (schema.properties?.position && schema.required?.every((name) => name === "position")) return { position: target };
  return schema.oneOf?.some((one) => one.properties?.Position) ? { Position: { position: target } } : undefined;
}

// Fields for a schema in `box`; returns the function that reads them.
function form(schema, defaults, box) {
  const properties = Object.entries(schema.properties ?? {});
  const isObject = schema.type === "object" || properties.length > 0;
  if (!isObject && Array.isArray(schema.type)) return () => undefined;
  const list = isObject ? properties : [["value", schema]];
  const readers = list.map(([name, property]) => {
    const preset = isObject ? defaults?.[name] : defaults;
    const { element, read } = field(resolve(property, schema), preset);
    const label = make("label", "", `${name}${property.unit ? `, ${property.unit}` : ""}`, element);
    label.title = property.description ?? "";
    element.name = name;
    box.append(label);
    if (property.description) label.append(make("span", "note", property.description));
    return [name, read];
  });
  return () => isObject ? Object.fromEntries(readers.map(([name, read]) => [name, read()]).filter(([, value]) => value !== undefined)) : readers[0][1]();
}

function resolve(property, schema) {
  const name = property.$ref?.replace("#/$defs/", "");
  return name ? { ...schema.$defs[name], ...property } : property;
}

function field(schema, preset) {
  if (schema.type === "boolean") {
    const element = Object.assign(make("input"), { type: "checkbox", checked: preset === true });
    return { element, read: () => element.checked };
  }
  if (schema.enum) {
    const element = make("select");
    element.append(...schema.enum.map((name) => new Option(name, name, name === preset, name === preset)));
    return { element, read: () => element.value };
  }
  const isNumber = schema.type === "number" || schema.anyOf?.some((one) => one.type === "number");
  if (schema.type === "integer" || isNumber) {
    const element = Object.assign(make("input"), { type: "number", step: schema.type === "integer" ? 1 : "any", min: schema.minimum ?? "", max: schema.maximum ?? "", value: typeof preset === "number" ? preset : "", required: true });
    return { element, read: () => Number(element.value) };
  }
  if (schema.type === "string") {
    const element = Object.assign(make("input"), { type: "text", value: preset ?? "" });
    return { element, read: () => element.value };
  }
  // Whatever else, as JSON.
  const element = Object.assign(make("input"), { type: "text", value: preset === undefined ? "" : JSON.stringify(preset), spellcheck: false });
  return { element, read: () => element.value.trim() === "" ? undefined : JSON.parse(element.value) };
}

// An event in words.
function describe({ path, kind, message }) {
  const of = message.payload ?? {}, low = (text) => String(text).replace(/([a-z])([A-Z])/g, "$1 $2").toLowerCase();
  const value = (of) => JSON.stringify(Object.values(of ?? {})[0]);
  switch (kind) {
    case "HealthTransition": return { kind: "health", text: `${of.estimator}: ${low(of.from)} → ${low(of.to)}, ${low(of.reason)} (${of.source})`, colour: COLOUR[low(of.to)] };
    case "ComponentFault": return { kind: "fault", text: `${of.path}: ${of.message}`, colour: "bad" };
    case "SafetyTransition": return { kind: "safety", text: `${low(of.from)} → ${low(of.to)}${of.caller ? `, by ${of.caller}` : ""}`, colour: of.to === "Error" ? "bad" : of.to === "Armed" ? "act" : "" };
    case "SafetyError": return { kind: "unsafe", text: `${of.path}: ${of.error.message}`, colour: "bad" };
    case "StateTransition": return { kind: "state", text: `${of.from} → ${of.to}${of.command ? `, by ${of.command}` : ""}`, colour: "" };
    case "ParameterChange": return { kind: "parameter", text: `${of.path}: ${value(of.from)} → ${value(of.to)}, by ${of.caller}`, colour: "" };
    case "CommandEvent": {
      const phase = typeof of.phase === "string" ? of.phase : Object.keys(of.phase)[0];
      const refused = of.phase.Refused, failed = of.phase.Failed;
      const why = failed !== undefined ? `: ${failed}` : refused ? `: ${low(refused.reason)}, in the state ${refused.state}` : "";
      return { kind: "command", text: `${of.command} ${low(phase)}${of.execution ? ` (no. ${of.execution})` : ""}${why}, for ${of.caller}`, colour: { Succeeded: "good", Failed: "bad", TimedOut: "bad", Refused: "warn" }[phase] ?? "" };
    }
    default: return { kind: path, text: JSON.stringify(of), colour: "" };
  }
}
