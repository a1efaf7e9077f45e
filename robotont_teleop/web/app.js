// Puts the page together: hands to commands, states to what is seen.
import {film} from "./camera.js";
import {CommandRate} from "./command_rate.js";
import {DrivingInputs} from "./driving_inputs.js";
import {actWhenHeld} from "./hold_button.js";
import {View} from "./map_view.js";
import {showNear} from "./near_ring.js";
import {$, number, write} from "./page.js";
import {LOW_CHARGE, nameOf, sentenceOf, showFacts, showLights, showWheels} from "./panel.js";
import {choosePlace} from "./place_press.js";
import {Link} from "./server_link.js";
import {languageList, text} from "./texts.js";
import {truth, worst} from "./truth.js";

const NOTE = 6000;    // [ms] that the robot's answers are shown
const REFUSED = 2000; // [ms] that a refusal is shown
const TAKEN = 4000;   // [ms] that is shown who has taken over
const STOP_TAKES = 300; // [ms] within which STOP usually has arrived
const VIBRATES = 600; // [ms] between two vibrations while it has not
const LOOK = 250;     // [ms] between two looks without any message: for stalls
const LONG = 60;      // letters that a bar may not have room for
const LYING = matchMedia("(max-height: 560px)"); // as in the style sheet
const SPEEDS = [0.3, 0.6, 1]; // parts of the fastest: slow, normal, fast
const app = $("app");
const chips = [...$("chips").children];

// A QR code that a browser scans once more has brought the token, which the login page has taken already.
const clearAddress = () => location.hash && history.replaceState(null, "", location.pathname);
clearAddress();
window.addEventListener("hashchange", clearAddress);

let state = null;
let status = null;
let limits = {linear: 0.5, angular: 2};
let speed = 1; // of SPEEDS
const note = {number: null, until: 0};
let refused = {key: "", until: 0}; // or another thing that the hands should know
let wish = null; // a place on the map [m], not sent yet
let vibrated = 0; // [ms]
const view = new View($("view"));

const link = new Link({
  hello: (message) => {
    limits = message;
    document.title = message.robot;
    write($("robot"), message.robot);
    setSpeed(speed);
  },
  connection: (open) => {
    app.dataset.state = open ? "open" : "lost";
    state = open ? state : null;
    status = open ? status : null;
    showPanel();
    show();
  },
  state: (message) => {
    if (drives() && message.driver !== null && message.driver !== link.page) {
      refused = {key: "taken", until: performance.now() + TAKEN};
      vibrate(200);
    }
    state = message;
    view.setPose(message.pose, !link.stalled, message.velocity);
    show();
    if (state.held.includes(link.page) && hands.still) {
      link.drive(0, 0, 0); // the hands are off
    }
  },
  status: takeStatus,
  pong: () => ($("round_trip").textContent = `${Math.round(link.roundTrip)} ms`),
  refused: () => (refused = {key: "can_take_over", until: performance.now() + REFUSED}),
  late: ({what}) => {
    if (what !== "drive") {
      refused = {key: "late", until: performance.now() + REFUSED};
    } else if (performance.now() >= refused.until) {
      refused = {key: "late_drive", until: performance.now() + REFUSED};
    }
  },
});
const stop = () => {
  link.stop();
  hands.letGo();
  show();
};
const hands = new DrivingInputs(() => rate.changed(), stop, (step, whole) => setSpeed(whole ? step : speed + step));
const rate = new CommandRate(() => hands.still, sendCommand);
const vibrate = (time) => navigator.userActivation?.hasBeenActive && navigator.vibrate?.(time);
const drives = () => state !== null && link.page !== null && state.driver === link.page;
film(() => Boolean(status?.camera));
setInterval(show, LOOK);

function sendCommand() {
  const {ahead, left, turn} = hands.position;
  const [fast, turning] = [limits.linear * SPEEDS[speed], limits.angular * SPEEDS[speed]];
  link.drive(ahead * fast, left * fast, turn * turning);
}

function setSpeed(wanted) {
  speed = Math.min(SPEEDS.length - 1, Math.max(0, wanted));
  chips.forEach((chip, place) => {
    chip.setAttribute("aria-pressed", place === speed);
    write(chip.lastElementChild, number(SPEEDS[place] * limits.linear));
  });
}

function takeStatus(message) {
  if (message.camera !== Boolean(status?.camera)) {
    setMain(message.camera ? "camera" : "map");
  }
  status = message;
  view.setStatus(message);
  showScale();
  if (note.number !== null && message.note.number !== note.number) {
    note.until = performance.now() + NOTE;
  }
  note.number = message.note.number;
  $("cancel").hidden = !message.goal;
  $("swap").hidden = $("camera").hidden = !message.camera;
  $("whole").hidden = !view.map;
  showPanel();
  show();
}

// Without a connection nothing is known
function showPanel() {
  showLights(status?.lights || [], status ? "no_reports" : "lost");
  showFacts(status || {pages: "–"});
}

function show() {
  const open = app.dataset.state === "open";
  const stalled = open && link.stalled;
  const now = open && !stalled ? state : null; // what is older is not shown as if it were of now
  const {who: [who, name], can: does, live} = truth({open, stalled, state, status, page: link.page});
  hands.setLive(live);
  const can = live && hands.dropped ? "can_let_go" : does;
  app.dataset.live = live;
  const fault = open ? worstFault() : null;
  $("dot").dataset.level = !open || state?.stopped || fault?.level === 2 ? 2 : fault?.level ?? (now ? 0 : 1);
  write($("driver"), `${text(who)} ${name}`.trim());
  write($("can"), text(can));
  $("can").dataset.key = can;
  $("take").hidden = !open || !state || state.driver === null || drives();
  $("give_back").hidden = !(drives() && state.driven_by === "hand" && status?.goal);
  $("stopped").hidden = showStopThatWaits(open) || !state?.stopped;
  $("stop").setAttribute("aria-pressed", Boolean(state?.stopped));
  $("release").disabled = Boolean(state) && state.driver !== null && !drives();
  $("release_why").hidden = !$("release").disabled;
  showFault(fault);
  if (wish && !maySend()) {
    setWish(null);
  }
  const words = message(open);
  $("message").hidden = !words;
  write($("message"), words);
  const [ahead, left, turning] = now?.velocity || [];
  write($("speed"), now?.velocity ? number(Math.hypot(ahead, left)) : "–");
  write($("turning"), now?.velocity ? number(turning) : "–");
  if (!now) {
    write($("round_trip"), "–");
    view.setPose(null);
  }
  $("near").toggleAttribute("hidden", view.whole && onMap());
  showNear($("near"), now && status?.near || [], onMap() && !view.headingUp ? view.pose?.[2] ?? 0 : 0);
  showWheels(now?.commanded, now?.measured, 1.2 * limits.linear);
}

// STOP has been pressed here, and the robot has not said that it stands by it; whether it is so
function showStopThatWaits(open) {
  const now = performance.now();
  const late = !open || now - link.stopAt > STOP_TAKES;
  const waits = (link.stopWanted && late) || Boolean(state?.stop_waits);
  $("stop_waits").hidden = !waits;
  $("stop").classList.toggle("waits", waits);
  if (waits && now - vibrated > VIBRATES) {
    vibrated = now;
    vibrate(300);
  }
  return waits;
}

// The light that a person should look at; null: all is well, or what is wrong is told already
function worstFault() {
  if (!status) {
    return null;
  }
  if (!status.lights.length) {
    return {name: "", level: 2, words: "", key: "", sentence: text("no_reports")};
  }
  const {charge} = status.battery || {};
  const empty = charge != null && charge <= LOW_CHARGE && {name: "battery", level: 1, words: "", key: "battery_low"};
  const told = state?.stopped ? /: (command stream|who drives|web page)$/ : /: web page$/;
  return worst(status.lights, told) || empty || null;
}

function showFault(fault) {
  $("fault").hidden = !fault;
  if (fault) {
    const sentence = fault.sentence || sentenceOf(fault);
    $("fault").dataset.level = fault.level;
    write($("fault_name"), fault.name ? nameOf(fault) : "");
    write($("fault_words"), sentence || fault.words);
    $("fault_words").lang = sentence ? "" : "en";
    write($("raw"), fault.words);
    $("more").hidden = !fault.words || (!sentence && fault.words.length < LONG);
    $("raw").hidden = $("more").hidden || $("more").getAttribute("aria-expanded") !== "true";
  }
}

// Bars stand over the view: what else stands there makes room, or goes where there is none
const room = new ResizeObserver(() => {
  const bars = $("alarms").offsetHeight;
  app.style.setProperty("--alarms", `${bars}px`);
  const {clientWidth, clientHeight} = $("stage");
  const tools = LYING.matches ? (clientWidth > 380 ? 62 : 115) : Math.max(124, $("tools").offsetHeight + 20);
  const words = Math.max($("message").offsetHeight, $("send").offsetHeight);
  app.classList.toggle("crowded", clientHeight - bars - words < tools);
});
for (const id of ["alarms", "stage", "tools", "message", "send"]) {
  room.observe($(id));
}

const onMap = () => app.dataset.main === "map";
const maySend = () => status !== null && status.navigation && view.map !== null && onMap();

function look(change) {
  view.look(change);
  $("heading").setAttribute("aria-pressed", view.headingUp);
  $("whole").setAttribute("aria-pressed", view.whole);
  showScale();
  show();
}

function showScale() {
  const {metres, pixels} = view.scaleBar;
  $("scale").firstElementChild.style.width = `${pixels}px`;
  write($("scale").lastElementChild, `${metres} m`);
}

function message(open) {
  const now = performance.now();
  if (wish) {
    return "";
  }
  if (!open) {
    return text("lost_advice");
  }
  if (now < refused.until) {
    return text(refused.key);
  }
  if (hands.padGone) {
    return text("fault_pad_gone");
  }
  return (now < note.until && status?.note.words) || status?.goal?.words || "";
}

// Where the robot would be sent: shown, with a button that does it
function setWish(place) {
  wish = place;
  view.mark("wish", place);
  $("send").hidden = !place;
  if (place) {
    const [x, y] = view.pose || place;
    write($("send"), `${text("send")}: ${number(Math.hypot(place[0] - x, place[1] - y))} m`);
  }
}

// What has the whole stage: the camera or the map; the other one is small
function setMain(which) {
  app.dataset.main = which;
  look({});
}

$("stop").addEventListener("pointerdown", stop);
$("stop").addEventListener("click", stop); // by keys and assistive devices, too
for (const id of ["take", "give_back", "reset_odometry"]) {
  $(id).addEventListener("click", () => link.order({kind: id}));
}
$("cancel").addEventListener("click", () => link.send({kind: "cancel"}));
$("closer").addEventListener("click", () => look({scale: view.scale + 1}));
$("farther").addEventListener("click", () => look({scale: view.scale - 1}));
$("heading").addEventListener("click", () => look({headingUp: !view.headingUp}));
$("whole").addEventListener("click", () => look({whole: !view.whole}));
choosePlace($("view"), maySend, (event) => setWish(event && view.world.place(event.clientX, event.clientY)));
$("send").addEventListener("click", () => {
  link.order({kind: "goal", x: wish[0], y: wish[1]});
  setWish(null);
});
$("swap").addEventListener("click", () => setMain(onMap() ? "camera" : "map"));
$("more").addEventListener("click", () => {
  $("more").setAttribute("aria-expanded", $("more").getAttribute("aria-expanded") !== "true");
  show();
});
$("details").addEventListener("click", () => {
  const open = app.classList.toggle("detailed");
  $("details").setAttribute("aria-expanded", open);
});
chips.forEach((chip, place) => chip.addEventListener("click", () => setSpeed(place)));
actWhenHeld($("release"), (pressed_at) => link.order({kind: "release", pressed_at}), () => state?.pressed_at ?? 0);
languageList($("language"), () => {
  showPanel();
  show();
});
setSpeed(speed);
look({});
