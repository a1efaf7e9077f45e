// Puts the page together: hands to commands, states to what is seen.
import {film} from "./camera.js";
import {commandRate} from "./command_rate.js";
import {DrivingInputs} from "./driving_inputs.js";
import {actWhenHeld, onLongPress} from "./hold_button.js";
import {View} from "./map_view.js";
import {showNear} from "./near_ring.js";
import {$, number, write} from "./page.js";
import {showFacts, showFault, showLights} from "./panel.js";
import {Link} from "./server_link.js";
import {languageButton, text} from "./texts.js";
import {truth} from "./truth.js";

const TOLD = 4000;    // [ms] that is shown what the person should know for a while
const STOP_TAKES = 300; // [ms] within which STOP usually has arrived
const LOOK = 250;     // [ms] between two looks without any message: for stalls
const PRESS = 500;    // [ms] of a press that chooses a place
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
let note = null; // number of the robot's newest answer
let told = {words: "", until: 0};
let wish = null; // a place on the map [m], not sent yet
let chooses = false; // whether a finger is on it
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
    takeStatus(open ? status : null);
  },
  state: (message) => {
    if (drives() && message.driver !== null && message.driver !== link.page) {
      tell(text("taken"));
    }
    state = message;
    view.setPose(message.pose, !link.stalled);
    show();
    if (state.held.includes(link.page) && hands.still) {
      link.order({kind: "drive", x: 0, y: 0, turn: 0}); // the hands are off
    }
  },
  status: (message) => {
    if (note !== null && message.note.number !== note) {
      tell(message.note.words);
    }
    note = message.note.number;
    view.setStatus(message);
    takeStatus(message);
  },
  refused: () => tell(text("can_take_over")),
  late: ({what}) => what !== "drive" ? tell(text("late")) : performance.now() >= told.until && tell(text("late_drive")),
});
const stop = () => {
  link.stop();
  hands.letGo();
  show();
};
const hands = new DrivingInputs(commandRate(() => hands.still, sendCommand), stop, setSpeed);
const drives = () => state !== null && link.page !== null && state.driver === link.page;
const tell = (words) => (told = {words, until: performance.now() + TOLD});

function sendCommand() {
  const {ahead, left, turn} = hands.position;
  const [fast, turning] = [limits.linear * SPEEDS[speed], limits.angular * SPEEDS[speed]];
  link.order({kind: "drive", x: ahead * fast, y: left * fast, turn: turn * turning});
}

function setSpeed(wanted) {
  speed = wanted;
  chips.forEach((chip, place) => {
    chip.ariaPressed = place === speed;
    write(chip.lastElementChild, number(SPEEDS[place] * limits.linear));
  });
}

// Without a connection nothing is known: null
function takeStatus(newest) {
  if (Boolean(newest?.camera) !== Boolean(status?.camera)) {
    look({}, newest?.camera ? "camera" : "map");
  }
  status = newest;
  $("cancel").hidden = !status?.goal;
  $("swap").hidden = $("camera").hidden = !status?.camera;
  const waits = app.dataset.state === "open" && !status; // for the first one
  showLights(status?.lights ?? [], waits ? "" : text(status ? "no_reports" : "lost"));
  showFacts(status ?? {});
  show();
}

function show() {
  const open = app.dataset.state === "open";
  const stalled = open && link.stalled;
  const now = open && !stalled ? state : null; // what is older is not shown as if it were of now
  const {who, can: does, live} = truth({open, stalled, state, status, page: link.page});
  hands.setLive(live);
  const can = live && hands.dropped ? "can_let_go" : does;
  app.dataset.live = live;
  const fault = open ? worstFault() : null;
  $("dot").dataset.level = !open || state?.stopped || fault?.level === 2 ? 2 : fault?.level ?? (now ? 0 : 1);
  const driver = `${text(who[0])} ${who[1]}`.trim();
  write($("driver"), driver);
  write($("stop_waits_who"), `${driver}.`);
  write($("can"), text(can));
  $("can").dataset.key = can;
  $("take").hidden = !open || !state || state.driver === null || drives();
  $("give_back").hidden = !(drives() && state.driven_by === "hand" && status?.goal);
  $("stopped").hidden = showStopThatWaits(open) || !state?.stopped;
  write($("stopped_by"), state?.stopped_by_class ? text("stopped_by_class") : text("stopped"));
  $("stop").ariaPressed = Boolean(state?.stopped);
  $("release").disabled = Boolean(state) && state.driver !== null && !drives();
  write($("release"), text($("release").disabled ? "can_take_over" : "release"));
  showFault(fault);
  if (wish && !maySend()) {
    setWish(null);
  }
  const words = wish ? "" : !open ? text("lost_advice") : performance.now() < told.until ? told.words :
    hands.padGone ? text("fault_pad_gone") : status?.goal?.words ?? "";
  $("message").hidden = !words;
  write($("message"), words);
  const [ahead, left, turning] = now?.velocity ?? [];
  write($("speed"), now?.velocity ? number(Math.hypot(ahead, left)) : "–");
  write($("turning"), now?.velocity ? number(turning) : "–");
  if (!now) {
    view.setPose(null, false);
    view.draw(); // the screen may have turned
  }
  const near = now && !(view.whole && onMap()) && status?.near || [];
  showNear($("near"), near, onMap() && !view.headingUp ? view.pose?.[2] ?? 0 : 0);
}

// STOP has been pressed here, and the robot has not said that it stands by it; whether it is so
function showStopThatWaits(open) {
  const late = !open || performance.now() - link.stopWanted?.at > STOP_TAKES;
  const waits = (link.stopWanted && late) || Boolean(state?.stop_waits);
  $("stop_waits").hidden = !waits;
  $("stop").classList.toggle("waits", waits);
  return waits;
}

// The light that a person should look at; null: all is well, or what is wrong is told already
function worstFault() {
  if (!status) {
    return null;
  }
  if (!status.lights.length) {
    return {name: "", level: 2, words: "", key: "no_reports"};
  }
  const told = state?.stopped ? /: (command stream|who drives|web page)$/ : /: web page$/;
  return status.lights.find((light) => light.level > 0 && !told.test(light.name)) ?? null;
}

const onMap = () => app.dataset.main === "map";
const maySend = () => status !== null && status.navigation && view.map !== null && onMap();

// main: what has the whole stage, the camera or the map; the other one is small. change: of whole, headingUp
function look(change, main = app.dataset.main) {
  app.dataset.main = main;
  Object.assign(view, {whole: false}, change);
  view.draw();
  $("heading").ariaPressed = view.headingUp;
  $("whole").ariaPressed = view.whole;
  show();
}

// Where the robot would be sent: shown, with a button that does it
function setWish(place) {
  wish = place;
  view.mark("wish", place);
  $("send").hidden = !place;
  if (place) {
    const [x, y] = view.pose ?? place;
    write($("send"), `${text("send")}: ${number(Math.hypot(place[0] - x, place[1] - y))} m`);
  }
}

const wishFor = ({clientX, clientY}) => setWish(view.place(clientX, clientY));

for (const event of ["pointerdown", "click"]) { // the latter by keys and assistive devices
  $("stop").addEventListener(event, stop);
}
for (const id of ["take", "give_back", "reset_odometry"]) {
  $(id).addEventListener("click", () => link.order({kind: id}));
}
for (const id of ["details", "more"]) {
  $(id).addEventListener("click", () => ($("details").ariaExpanded = app.classList.toggle("detailed")));
}
for (const [id, act] of Object.entries({
  cancel: () => link.send({kind: "cancel"}),
  heading: () => look({headingUp: !view.headingUp}),
  whole: () => look({whole: !view.whole}),
  swap: () => look({}, onMap() ? "camera" : "map"),
  send: () => {
    link.order({kind: "goal", x: wish[0], y: wish[1]});
    setWish(null);
  },
})) {
  $(id).addEventListener("click", act);
}
onLongPress($("view"), PRESS, () => {
  setWish(null); // a tap takes it back
  return maySend();
}, (event) => {
  chooses = true;
  wishFor(event);
}, () => (chooses = false));
$("view").addEventListener("pointermove", (event) => chooses && wishFor(event));
chips.forEach((chip, place) => chip.addEventListener("click", () => setSpeed(place)));
actWhenHeld($("release"), (pressed_at) => link.order({kind: "release", pressed_at}), () => state?.pressed_at ?? 0);
languageButton($("language"), () => takeStatus(status));
film(() => Boolean(status?.camera));
setInterval(show, LOOK);
setSpeed(speed);
