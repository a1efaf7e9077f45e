// Puts the page together: hands to commands, states to what is seen.
import {toggleCamera} from "./camera.js";
import {CommandRate} from "./command_rate.js";
import {DrivingInputs} from "./driving_inputs.js";
import {actWhenHeld} from "./hold_button.js";
import {View} from "./map_view.js";
import {$, number, write} from "./page.js";
import {adviceOf, byWorst, nameOf, showFacts, showLights, showWheels} from "./panel.js";
import {Link} from "./server_link.js";
import {chosenLanguage, setLanguage, text} from "./texts.js";

const NOTE = 6000;    // [ms] that the robot's answers are shown
const REFUSED = 2000; // [ms] that a refusal is shown
const TAKEN = 4000;   // [ms] that is shown who has taken over
const LOW_CHARGE = 0.15;
const LOOK = 250;     // [ms] between two looks without any message: for stalls
const app = $("app");

// A QR code that a browser scans once more has brought the token, which the login page has taken already.
const clearAddress = () => location.hash && history.replaceState(null, "", location.pathname);
clearAddress();
window.addEventListener("hashchange", clearAddress);

let state = null;
let status = null;
let limits = {linear: 0.5, angular: 2};
let note = {number: null, until: 0};
let refused = {key: "", until: 0}; // or another thing that the hands should know
let goalMode = false;
const view = new View($("view"));

const link = new Link({
  hello: (message) => {
    limits = message;
    document.title = message.robot;
    write($("robot"), message.robot);
    showCap();
  },
  connection: (open) => {
    app.dataset.state = open ? "open" : "lost";
    state = open ? state : null;
    status = open ? status : null;
    hands?.letGo();
    showPanel();
    show();
  },
  state: (message) => {
    if (drives() && message.driver !== null && message.driver !== link.page) {
      refused = {key: "taken", until: performance.now() + TAKEN};
      navigator.vibrate?.(200);
    }
    state = message;
    view.setPose(message.pose, !link.stalled);
    if (mustLetGo() && hands.still) {
      link.drive(0, 0, 0); // the hands are off
    }
    show();
  },
  status: takeStatus,
  pong: () => ($("round_trip").textContent = `${Math.round(link.roundTrip)} ms`),
  refused: () => (refused = {key: "not_driver", until: performance.now() + REFUSED}),
  late: () => (refused = {key: "late", until: performance.now() + REFUSED}),
});
const stop = () => link.stop();
const hands = new DrivingInputs(() => rate.changed(), stop);
const rate = new CommandRate(() => hands.still, sendCommand);
const drives = () => state !== null && link.page !== null && state.driver === link.page;
const mustLetGo = () => state !== null && state.held.includes(link.page);
setInterval(show, LOOK);

function sendCommand() {
  if (!hands.still && (link.stalled || mustLetGo())) {
    return; // the server would drop it; in a stall it would only queue up
  }
  const cap = $("cap").value / 100;
  const {ahead, left, turn} = hands.position;
  link.drive(ahead * limits.linear * cap, left * limits.linear * cap, turn * limits.angular * cap);
}

function takeStatus(message) {
  status = message;
  view.setStatus(message);
  view.setScan(message.scan);
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
  showPanel();
  show();
}

// Without a connection nothing is known
function showPanel() {
  showLights(status?.lights || [], status ? "no_reports" : "lost");
  showFacts(status || {ranges: [], pages: "–"});
}

function show() {
  const open = app.dataset.state === "open";
  const stalled = open && link.stalled;
  const now = open && !stalled ? state : null; // what is older is not shown as if it were of now
  const worst = worstLight();
  $("dot").dataset.level = !open || state?.stopped || worst?.level === 2 ? 2 : worst?.level ?? (now ? 0 : 1);
  write($("driver"), open && state ? text(who()) : text("lost"));
  $("take").hidden = !open || !state || state.driver === null || drives();
  $("give_back").hidden = !(drives() && state.driven_by === "hand" && status?.goal);
  app.dataset.role = drives() || state?.driver === null ? "driver" : "viewer";
  $("stopped").hidden = !state?.stopped;
  $("stop").setAttribute("aria-pressed", Boolean(state?.stopped));
  $("release").disabled = Boolean(state) && state.driver !== null && !drives();
  $("release_why").hidden = !$("release").disabled;
  write($("release_why"), text("not_driver"));
  $("fault").hidden = !open || !worst;
  if (open && worst) {
    $("fault").dataset.level = worst.level;
    write($("fault_name"), worst.name ? nameOf(worst) : "");
    write($("fault_words"), adviceOf(worst));
  }
  const words = message(open, stalled);
  $("message").hidden = !words;
  write($("message"), words);
  const [ahead, left, turning] = now?.velocity || [];
  write($("speed"), now?.velocity ? number(Math.hypot(ahead, left)) : "–");
  write($("turning"), now?.velocity ? number(turning) : "–");
  if (!now) {
    write($("round_trip"), "–");
    view.setPose(null);
  }
  showWheels(now?.commanded, now?.measured, 1.2 * limits.linear);
}

// The light that a person should look at; null: all is well, or what is wrong is told already
function worstLight() {
  if (!status) {
    return null;
  }
  const {charge} = status.battery || {};
  if (!status.lights.length) {
    return {name: "", level: 2, words: text("no_reports")};
  }
  const told = state?.stopped ? /: (command stream|who drives|web page)$/ : /: web page$/;
  const worst = byWorst(status.lights.filter((light) => !told.test(light.name)))[0];
  const empty = charge != null && charge <= LOW_CHARGE && {name: "battery", level: 1, words: text("fault_battery")};
  return worst?.level ? worst : empty || null;
}

new ResizeObserver(() => app.style.setProperty("--alarms", `${$("alarms").offsetHeight}px`)).observe($("alarms"));

function showCap() {
  write($("cap_value"), number($("cap").value / 100 * limits.linear));
}

function zoom(step) {
  view.zoom(step);
  const {metres, pixels} = view.scaleBar;
  $("scale").firstElementChild.style.width = `${pixels}px`;
  write($("scale").lastElementChild, `${metres} m`);
}

function who() {
  if (state.stopped) {
    return "stopped";
  }
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
    return text(link.stopWanted ? "stop_waits" : "lost_advice");
  }
  if (stalled) {
    return text("slow");
  }
  if (link.stopWanted) {
    return text("stop_waits");
  }
  if (!hands.still && mustLetGo() && (drives() || state.driver === null) && !state.stopped) {
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
    return status?.note.words || "";
  }
  return status?.goal?.words || "";
}

function setGoalMode(on) {
  goalMode = on;
  $("goal").setAttribute("aria-pressed", on);
  app.classList.toggle("choosing", on);
  show();
}

function setLanguageTo(code) {
  setLanguage(code);
  $("language").value = code;
  $("camera").alt = text("camera");
  showPanel();
  show();
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
$("closer").addEventListener("click", () => zoom(1));
$("farther").addEventListener("click", () => zoom(-1));
$("goal").addEventListener("click", () => setGoalMode(!goalMode));
$("view").addEventListener("click", (event) => {
  if (goalMode) {
    const [x, y] = view.world.place(event.clientX, event.clientY);
    link.order({kind: "goal", x, y});
    setGoalMode(false);
  }
});
$("film").addEventListener("click", toggleCamera);
$("details").addEventListener("click", () => {
  const open = app.classList.toggle("detailed");
  $("details").setAttribute("aria-expanded", open);
});
$("cap").addEventListener("input", showCap);
$("language").addEventListener("change", () => {
  setLanguageTo($("language").value);
  try {
    localStorage.setItem("language", $("language").value);
  } catch {
    // no storage: asked anew next time
  }
});
actWhenHeld($("release"), () => link.order({kind: "release"}));
setLanguageTo(chosenLanguage());
showCap();
zoom(0);
