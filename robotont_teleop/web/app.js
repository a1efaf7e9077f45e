// Puts the page together: hands to commands, states to what is seen.
import {toggleCamera} from "./camera.js";
import {Hands} from "./hands.js";
import {actWhenHeld} from "./hold.js";
import {Link} from "./link.js";
import {Pace} from "./pace.js";
import {$, number, write} from "./page.js";
import {showFacts, showLights, showWheels} from "./panel.js";
import {chosenLanguage, setLanguage, text} from "./texts.js";
import {View} from "./view.js";

const NOTE = 6000;    // [ms] that the robot's answers are shown
const REFUSED = 2000; // [ms] that a refusal is shown
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
  scan: (message) => view.setScan(message),
  pong: () => ($("round_trip").textContent = `${Math.round(link.roundTrip)} ms`),
  refused: () => (refused = {key: "not_driver", until: performance.now() + REFUSED}),
  late: () => (refused = {key: "late", until: performance.now() + REFUSED}),
});
const stop = () => link.stop();
const hands = new Hands(() => pace.changed(), stop);
const pace = new Pace(() => hands.still, sendCommand);
const drives = () => state !== null && link.page !== null && state.driver === link.page;
setInterval(show, LOOK);

function sendCommand() {
  if (!hands.still && (link.stalled || (drives() && state.hands_off))) {
    return; // the server would drop it; in a stall it would only queue up
  }
  const cap = $("cap").value / 100;
  const {ahead, left, turn} = hands.position;
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
  write($("driver"), open && state ? text(who()) : text("lost"));
  $("take").hidden = !open || !state || state.driver === null || drives();
  $("give_back").hidden = !(drives() && state.driven_by === "hand" && status?.goal);
  app.dataset.role = drives() || state?.driver === null ? "driver" : "viewer";
  $("stopped").hidden = !state?.stopped;
  $("release").disabled = Boolean(state) && state.driver !== null && !drives();
  const words = message(open, stalled);
  $("message").hidden = !words;
  write($("message"), words);
  const [ahead, left, turning] = state?.velocity || [];
  write($("speed"), state?.velocity ? number(Math.hypot(ahead, left)) : "–");
  write($("turning"), state?.velocity ? number(turning) : "–");
  showWheels(state?.commanded, state?.measured, 1.2 * limits.linear);
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
  if (status) {
    showFacts(status);
  }
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
$("film").addEventListener("click", toggleCamera);
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
actWhenHeld($("release"), () => link.order({kind: "release"}));
setLanguageTo(chosenLanguage());
