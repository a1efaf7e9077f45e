// The fleet's page: asks for all robots twice a second, and sends orders. What a robot says is shown as text only.
import {FleetMap} from "./fleet_map.js";
import {actWhenHeld} from "./hold_button.js";
import {$, chargeOf, write} from "./page.js";
import {languageButton, speak, text} from "./texts.js";

const PERIOD = 500, PATIENCE = 2000, OLD = 2000, RETRY = 100, STILL = 3000, TOAST = 5000;  // [ms]
const LEVELS = {"": 0, warning: 1, low: 1, held: 1, silent: 3, gone: 3};  // of a need; the others: 2
const unsent = new Map(); // presses of STOP that have not arrived, by the robot's name, "" for all
const map = new FleetMap($("map"));
let cards = new Map();    // by the robot's key
let view = null, heard = -Infinity, aiming = null, touched = -Infinity, failed = -Infinity;

const key = (robot) => `${robot.name} ${robot.id}`;
const sentences = (words, between) => words.filter(Boolean).join(between);

async function post(fields) {
  const request = {method: "POST", body: JSON.stringify(fields), signal: AbortSignal.timeout(PATIENCE)};
  return (await fetch("order", request).catch(() => null))?.ok;
}

// Sends a STOP until it has arrived; a newer one takes its place, and waits for none that hangs.
async function stop(name = "") {
  const press = Symbol(name);
  unsent.set(name, press);
  setTimeout(showTroubles, RETRY);
  while (unsent.get(name) === press) {
    if (await post({kind: "stop", name: name || undefined})) {
      unsent.delete(name);
    }
    showTroubles();
    await new Promise((resolve) => setTimeout(resolve, RETRY));
  }
}

function showTroubles() {
  const now = performance.now();
  $("unsent").hidden = !unsent.size;
  $("toast").hidden = now - failed > TOAST;
  $("lost").hidden = now - heard <= OLD;
  document.body.classList.toggle("old", now - heard > OLD);
}

// Sends what is of this moment only, once.
async function order(fields) {
  failed = await post(fields) ? -Infinity : performance.now();
  showTroubles();
}

function aim(robot) {
  aiming = robot && aiming !== key(robot) ? key(robot) : null;
  $("choosing").hidden = !aiming;
  write($("choosing"), aiming ? text("aim", robot.name) : "");
  for (const [one, card] of cards) {
    card.querySelector(".goal").ariaPressed = aiming === one;
  }
  if (aiming) {
    $("map").scrollIntoView({block: "center"});
  }
}

function makeCard({name, id}) {
  const card = $("card").content.firstElementChild.cloneNode(true);
  const on = (selector, act) => card.querySelector(selector).addEventListener("click", act);
  speak(card);
  write(card.querySelector("h2"), name);
  card.ariaLabel = name;
  on(".one", () => stop(name));
  on(".goal", () => aim({name, id}));
  on(".cancel", () => order({kind: "cancel", name}));
  return card;
}

function age(seconds) {
  const [unit, length] = seconds < 100 ? ["second", 1] : seconds < 6000 ? ["minute", 60] : ["hour", 3600];
  const time = new Intl.RelativeTimeFormat(document.documentElement.lang, {style: "narrow", numeric: "auto"});
  return seconds === null ? text("age_none") : time.format(seconds < 3 ? 0 : -Math.round(seconds / length), unit);
}

function words({need, worst, stopped, name, asked, present, note}) {
  if (need === "error" || need === "warning") {
    return text(`fault_${worst.fault}`) || `${worst.task}: ${worst.words}`;
  }
  return sentences([text(`need_${need}`, need === "stopped" ? stopped : name),
    asked && !present && text("stop_asked"), present && note], " · ");
}

function fill(card, robot) {
  const find = (selector) => card.querySelector(selector);
  card.toggleAttribute("data-gone", !robot.present);
  card.dataset.need = robot.need;
  find(".dot").dataset.level = LEVELS[robot.need] ?? 2;
  write(find(".age"), age(robot.age));
  write(find(".charge"), chargeOf(robot.battery));
  write(find(".words"), words(robot));
  write(find(".now"), sentences([robot.driven_by && text("driven_by", robot.driven_by),
    robot.speed && `${robot.speed[0].toFixed(2)} m/s`, robot.frame !== "map" && text("not_on_map")], " · "));
  find(".goal").disabled = !robot.present || robot.frame !== "map";
  find(".cancel").disabled = !robot.present;
  find(".own").hidden = !robot.page;
  find(".own").href = robot.page || "#";
  return card;
}

function showStop({all, stand, waiting, gone, left}) {
  const asked = stand.length + waiting.length + gone.length;
  const told = (key, names) => names.length > 0 && text(key, names.join(", "));
  $("stopping").hidden = !(all || asked || left.length);
  $("stopping").classList.toggle("done", !waiting.length && !gone.length);
  $("stop_all").ariaPressed = all;
  write($("stop_words"), sentences([(all || asked > 0) && text("stop_holds", stand.length, asked),
    told("stop_waiting", waiting), told("stop_gone", gone), told("stop_left", left)], " "));
}

function show() {
  cards = new Map(view.robots.map((robot) => [key(robot), fill(cards.get(key(robot)) ?? makeCard(robot), robot)]));
  const shown = [...cards.values()], before = [...$("robots").children];
  const others = shown.length !== before.length || shown.some((card) => !before.includes(card));
  if (others || (performance.now() - touched > STILL && shown.some((card, place) => before[place] !== card))) {
    $("robots").replaceChildren(...shown);  // not from under a finger
  }
  write($("count"), text("connected", view.robots.filter((robot) => robot.present).length, view.robots.length));
  $("need").hidden = !view.need;
  write($("need"), text("need", view.need));
  $("none").hidden = view.robots.length > 0;
  showStop(view.stop);
  $("map").hidden = !view.ground && !view.robots.some((robot) => robot.frame === "map");
  map.draw(view, (robot) => key(robot) === aiming);
}

async function ask() {
  try {
    const answer = await fetch("robots", {signal: AbortSignal.timeout(PATIENCE)});
    if (answer.status === 401 && !unsent.size) {
      location.reload();
    }
    if (answer.ok) {
      view = await answer.json();
      show();
      heard = performance.now();
    }
  } catch { /* the bar says so */ }
  showTroubles();
  setTimeout(ask, PERIOD);
}

languageButton($("language"), () => view && show());
$("stop_all").addEventListener("click", () => stop());
actWhenHeld($("release"), (newest) => order({kind: "release", newest}), () => view.stop.newest);
$("map").addEventListener("click", (event) => {
  const robot = view.robots.find((one) => key(one) === aiming);
  if (robot) {
    const [x, y] = map.place(event.clientX, event.clientY);
    order({kind: "goal", name: robot.name, id: robot.id, seen: robot.number, x, y});
    aim(null);
  }
});
for (const event of ["pointerdown", "pointermove"]) {
  $("robots").addEventListener(event, () => (touched = performance.now()));
}
document.addEventListener("keydown", (event) => event.key === "Escape" && aim(null));
window.addEventListener("beforeunload", (event) => unsent.size && event.preventDefault());
new ResizeObserver(() => view && show()).observe($("map"));
ask();
