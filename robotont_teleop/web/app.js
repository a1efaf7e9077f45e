// Puts the page together: hands to commands, states to what is seen.
import {Hands} from "./hands.js";
import {Link} from "./link.js";
import {chosenLanguage, setLanguage, text} from "./texts.js";
import {View} from "./view.js";

const REPEAT = 40;      // [ms] between two commands while the hands hold something
const SOONEST = 16;     // [ms] between two commands when they move
const HOLD = 1000;      // [ms] that the release of the emergency stop takes
const NOTE = 6000;      // [ms] that the robot's answers are shown
const REFUSED = 2000;   // [ms] that a refusal is shown
const $ = (id) => document.getElementById(id);
const app = $("app");

let state = null;
let status = null;
let limits = {linear: 0.5, angular: 2};
let sentAt = -Infinity;
let later = null;
let moving = false;
let note = {number: null, until: 0};
let refused = {key: "", until: 0};
let heldInVain = false; // the hands have held something since another page drove
let goalMode = false;
const view = new View($("view"));

const link = new Link({
  hello: (message) => (limits = message),
  connection: (open) => {
    app.dataset.state = open ? "open" : "lost";
    state = open ? state : null;
    hands?.letGo();
    show();
  },
  state: (message) => {
    state = message;
    heldInVain = !hands.still && !drives() && (heldInVain || state.driver !== null);
    view.setPose(message.pose);
    if (message.hands_off && drives() && hands.still) {
      link.drive(0, 0, 0); // the hands are off
    }
    show();
  },
  status: takeStatus,
  scan: (message) => view.setScan({...message, at: performance.now()}),
  pong: () => ($("round_trip").textContent = `${Math.round(link.roundTrip)} ms`),
  refused: () => (refused = {key: "not_driver", until: performance.now() + REFUSED}),
  late: () => (refused = {key: "late", until: performance.now() + REFUSED}),
});
const stop = () => link.stop();
const hands = new Hands(command, stop);
const drives = () => state !== null && link.page !== null && state.driver === link.page;
setInterval(() => moving && command(), REPEAT);
setInterval(show, 250); // stalls show without any message

// Send what the hands ask for now; a moment later when the last command has only just gone.
function command() {
  const wait = SOONEST - (performance.now() - sentAt);
  if (wait > 0 && !hands.still) {
    later ??= setTimeout(command, wait);
    return;
  }
  clearTimeout(later);
  later = null;
  if (hands.still && !moving) {
    return;
  }
  moving = !hands.still;
  if (moving && (link.stalled || (drives() && state.hands_off))) {
    return; // the server would drop it; in a stall it would only queue up
  }
  const cap = $("cap").value / 100;
  const {ahead, left, turn} = hands.position;
  sentAt = performance.now();
  link.drive(ahead * limits.linear * cap, left * limits.linear * cap, turn * limits.angular * cap);
}

function takeStatus(message) {
  status = message;
  view.setStatus(message);
  if (note.number !== null && message.note.number !== note.number) {
    note.until = performance.now() + NOTE;
  }
  note.number = message.note.number;
  $("goal").hidden = !message.navigation || message.frame !== "map";
  $("cancel").hidden = !message.goal;
  $("film").hidden = !message.camera;
  if ($("goal").hidden) {
    setGoalMode(false);
  }
  showLights(message.lights);
  showFacts(message);
  show();
}

function show() {
  const open = app.dataset.state === "open";
  const stalled = open && link.stalled;
  $("dot").dataset.level = !open ? 2 : stalled || !state ? 1 : 0;
  $("driver").textContent = open && state ? text(who()) : text("lost");
  $("take").hidden = !open || !state || state.driver === null || drives();
  $("give_back").hidden = !(drives() && state.driven_by === "hand" && status?.goal);
  app.dataset.role = drives() || state?.driver === null ? "driver" : "viewer";
  $("stopped").hidden = !state?.stopped;
  $("release").disabled = Boolean(state) && state.driver !== null && !drives();
  const words = message(open, stalled);
  $("message").hidden = !words;
  if ($("message").textContent !== words) {
    $("message").textContent = words;
  }
  const velocity = state?.velocity;
  $("speed").textContent = velocity ? number(Math.hypot(velocity[0], velocity[1])) : "–";
  $("turning").textContent = velocity ? number(velocity[2]) : "–";
  showWheels();
}

function who() {
  if (state.driven_by === "navigation") {
    return drives() ? "who_you_navigation" : "who_navigation";
  }
  if (state.driver !== null) {
    return drives() ? "who_you" : "who_other";
  }
  return {hand: "who_hand", default: "who_default"}[state.driven_by] || "who_nobody";
}

function message(open, stalled) {
  const now = performance.now();
  if (!open) {
    return text(link.stopWanted ? "stop_waits" : "lost");
  }
  if (stalled) {
    return text("slow");
  }
  if (link.stopWanted) {
    return text("stop_waits");
  }
  if (!hands.still && ((state?.hands_off && drives()) || (heldInVain && state?.driver === null))) {
    return text("hands_off");
  }
  if (now < refused.until) {
    return text(refused.key);
  }
  if (!hands.still && state && state.driver !== null && !drives()) {
    return text("not_driver");
  }
  if (goalMode) {
    return text("goal_hint");
  }
  if (now < note.until) {
    return status.note.words;
  }
  return status?.goal?.words || "";
}

function showLights(lights) {
  const worst = Math.max(0, ...lights.map((light) => light.level));
  $("worst").dataset.level = worst;
  $("lights").replaceChildren(...lights.map(({name, level, words}) => {
    const line = document.createElement("li");
    const dot = document.createElement("span");
    dot.className = "dot";
    dot.dataset.level = level;
    dot.setAttribute("role", "img");
    dot.setAttribute("aria-label", ["OK", "WARN", "ERROR", "STALE"][level] || "ERROR");
    const title = document.createElement("b");
    title.textContent = name.replace(/^.*: /, "");
    const said = document.createElement("span");
    said.textContent = words;
    line.append(dot, title, said);
    return line;
  }));
}

function showWheels() {
  const commanded = state?.commanded || state?.measured?.map(() => 0) || [];
  const box = $("wheels");
  while (box.childElementCount < commanded.length) {
    const row = document.createElement("div");
    row.innerHTML = '<span class="bar"><i class="wanted"></i><i class="real"></i></span>' +
      '<span class="wanted"></span><span class="real"></span><span>m/s</span>';
    box.append(row);
  }
  commanded.forEach((wanted, wheel) => {
    const real = state.measured?.[wheel] ?? null;
    const row = box.children[wheel];
    setBar(row.querySelector("i.wanted"), wanted);
    setBar(row.querySelector("i.real"), real ?? 0);
    row.querySelector("span.wanted").textContent = number(wanted);
    row.querySelector("span.real").textContent = real === null ? "–" : number(real);
  });
}

// Two decimals, and no zero with a sign
function number(value) {
  return (Math.round(value * 100) / 100 + 0).toFixed(2);
}

function setBar(bar, speed) {
  const part = Math.max(-1, Math.min(1, speed / (1.2 * limits.linear)));
  bar.style.left = `${50 + Math.min(0, part) * 50}%`;
  bar.style.width = `${Math.abs(part) * 50}%`;
}

function showFacts({board, battery, ranges, pages}) {
  const facts = [];
  if (battery?.voltage != null) {
    const charge = battery.charge === null ? "" : `${Math.round(battery.charge * 100)} % `;
    facts.push(["battery", `${charge}${battery.voltage.toFixed(1)} V`]);
    $("battery").textContent = charge || `${battery.voltage.toFixed(1)} V`;
  }
  $("battery").hidden = battery?.voltage == null;
  if (ranges.length) {
    facts.push(["distances", ranges.map((range) => (range === null ? "–" : range.toFixed(2))).join("  ") + " m"]);
  }
  if (board) {
    facts.push(["board", board]);
  }
  facts.push(["pages", String(pages)]);
  $("facts").replaceChildren(...facts.flatMap(([name, value]) => {
    const [term, fact] = [document.createElement("dt"), document.createElement("dd")];
    term.textContent = text(name);
    fact.textContent = fact.title = value;
    return [term, fact];
  }));
}

function setGoalMode(on) {
  goalMode = on;
  $("goal").setAttribute("aria-pressed", on);
  app.classList.toggle("choosing", on);
  show();
}

// The newest picture only, one after another, on a connection of its own: a slow line shows fewer, and no command waits.
async function film() {
  let after = 0;
  while ($("film").getAttribute("aria-pressed") === "true") {
    try {
      const response = await fetch(`camera.jpg?after=${after}`, {cache: "no-store", priority: "low"});
      if (response.ok && !document.hidden) {
        after = response.headers.get("X-Picture");
        await showPicture(new Uint8Array(await response.arrayBuffer()));
        continue;
      }
    } catch {
      // no connection: try again
    }
    $("camera").removeAttribute("src"); // an old picture must not look like one of now
    await new Promise((resolve) => setTimeout(resolve, 500));
  }
}

async function showPicture(bytes) {
  const address = URL.createObjectURL(new Blob([bytes], {type: "image/jpeg"}));
  $("camera").src = address;
  await $("camera").decode().catch(() => null);
  URL.revokeObjectURL(address);
}

function setLanguageTo(code) {
  setLanguage(code);
  $("language").value = code;
  $("camera").alt = text("camera");
  if (status) {
    showFacts(status);
  }
  show();
}

// Only a press of a whole second releases: the ring fills while it lasts.
function holdToRelease(button) {
  let timer = null;
  const begin = () => {
    if (timer === null && !button.disabled) {
      button.classList.add("filling");
      timer = setTimeout(() => {
        end();
        link.order({kind: "release"});
      }, HOLD);
    }
  };
  const end = () => {
    clearTimeout(timer);
    timer = null;
    button.classList.remove("filling");
  };
  button.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    begin();
  });
  button.addEventListener("keydown", (event) => ["Enter", "Space"].includes(event.code) && begin());
  for (const event of ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"]) {
    button.addEventListener(event, end);
  }
  window.addEventListener("blur", end);
  document.addEventListener("visibilitychange", end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}

$("stop").addEventListener("pointerdown", () => {
  stop();
  hands.letGo();
});
$("stop").addEventListener("click", stop); // by keys and assistive devices, too
for (const id of ["take", "give_back", "reset_odometry"]) {
  $(id).addEventListener("click", () => link.order({kind: id}));
}
$("cancel").addEventListener("click", () => link.send({kind: "cancel"}));
$("closer").addEventListener("click", () => view.zoom(1));
$("farther").addEventListener("click", () => view.zoom(-1));
$("goal").addEventListener("click", () => setGoalMode(!goalMode));
$("view").addEventListener("click", (event) => {
  if (goalMode) {
    const [x, y] = view.place(event.clientX, event.clientY);
    link.order({kind: "goal", x, y});
    setGoalMode(false);
  }
});
$("film").addEventListener("click", () => {
  const on = $("film").getAttribute("aria-pressed") !== "true";
  $("film").setAttribute("aria-pressed", on);
  $("camera").hidden = !on;
  if (on) {
    film();
  }
});
$("details").addEventListener("click", () => {
  const open = app.classList.toggle("detailed");
  $("details").setAttribute("aria-expanded", open);
});
$("cap").addEventListener("input", () => ($("cap_value").textContent = $("cap").value));
$("language").addEventListener("change", () => {
  setLanguageTo($("language").value);
  try {
    localStorage.setItem("language", $("language").value);
  } catch {
    // no storage: asked anew next time
  }
});
holdToRelease($("release"));
setLanguageTo(chosenLanguage());
