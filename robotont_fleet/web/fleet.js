// The fleet's page: asks for all robots twice a second, and sends orders. What a robot says is shown as text only.
import {draw, shortNames, world} from "./fleet_map.js";
import {FLEET_TEXTS} from "./fleet_texts.js";
import {actWhenHeld} from "./hold_button.js";
import {$, write} from "./page.js";
import {addTexts, languageList, text, textOr} from "./texts.js";

const PERIOD = 500, PATIENCE = 3000, OLD = 2000, RETRY = 100, STILL = 3000, TOAST = 5000;  // [ms]
const LEVELS = {"": 0, warning: 1, low: 1, held: 1, silent: 3, gone: 3};  // of a need; the others: 2
const TITLES = {"": "level_ok", warning: "level_warning", error: "level_error"}; // the others have their own
const NAMED = 6;         // robots that a line names
const cards = new Map(); // by the robot's key
const unsent = new Map(); // STOPs that have not arrived, by name, "" for all, and what ends each
let view = null, heard = -Infinity, asking = false, failed = false, aiming = null, touched = -Infinity;

const key = (robot) => `${robot.name} ${robot.id}`;

function say(name, ...values) {
  return values.reduce((words, value) => words.replace("{}", () => value), text(name));
}

async function post(fields, given) {
  const end = new AbortController(), late = setTimeout(() => end.abort(), PATIENCE);
  given?.addEventListener("abort", () => end.abort(), {signal: end.signal});
  try {
    return (await fetch("order", {method: "POST", body: JSON.stringify(fields), signal: end.signal})).ok;
  } catch {
    return false;
  } finally {
    clearTimeout(late);
    end.abort();
  }
}

// Sends a STOP until it has arrived, and waits for none that hangs.
async function stop(name) {
  const end = new AbortController(), key = name ?? "";
  for (const one of name ? [name] : [...unsent.keys()]) {
    unsent.get(one)?.abort();
    unsent.delete(one);
  }
  unsent.set(key, end);
  setTimeout(showUnsent, RETRY);
  while (!await post({kind: "stop", name}, end.signal) && !end.signal.aborted) {
    showUnsent();
    await new Promise((resolve) => {
      const signal = AbortSignal.timeout(RETRY);
      signal.addEventListener("abort", resolve);
      window.addEventListener("online", resolve, {signal});
    });
  }
  if (unsent.get(key) === end) {
    unsent.delete(key);
  }
  showUnsent();
  ask();
}

function showUnsent() {
  $("unsent").hidden = !unsent.size;
}

// Sends what is of this moment only, once.
async function order(fields) {
  if (!await post(fields)) {
    write($("toast"), text("not_sent"));
    $("toast").hidden = false;
    clearTimeout(failed);
    failed = setTimeout(() => $("toast").hidden = true, TOAST);
  }
  ask();
}

function aim(robot) {
  aiming = robot && aiming !== key(robot) ? key(robot) : null;
  $("choosing").hidden = !aiming;
  write($("choosing"), aiming ? say("aim", robot.name) : "");
  document.body.classList.toggle("aiming", Boolean(aiming));
  for (const [one, card] of cards) {
    card.querySelector(".goal").setAttribute("aria-pressed", String(aiming === one));
  }
  if (aiming) {
    $("stage").scrollIntoView({block: "center"});
  }
}

function makeCard(robot) {
  const card = $("card").content.firstElementChild.cloneNode(true), name = robot.name;
  card.querySelector("h2").textContent = name;
  card.querySelector(".one").setAttribute("aria-label", `STOP ${name}`);
  const acts = {one: () => stop(name), cancel: () => order({kind: "cancel", name}),
    goal: () => aim(view.robots.find((one) => key(one) === key(robot)))};
  for (const [what, act] of Object.entries(acts)) {
    card.querySelector(`.${what}`).onclick = act;
  }
  return card;
}

function age(seconds) {
  return seconds === null ? say("age_none") : seconds < 3 ? say("age_now") : seconds < 100 ? say("age_seconds", Math.round(seconds))
    : seconds < 6000 ? say("age_minutes", Math.round(seconds / 60)) : say("age_hours", Math.round(seconds / 3600));
}

function words(robot) {
  const {need, worst} = robot;
  if (need === "error" || need === "warning") {
    return textOr(`fault_${worst.fault}`, `${worst.task}: ${worst.words}`);
  }
  const told = need && say(`need_${need}`, need === "stopped" ? robot.stopped : robot.name);
  return [told, robot.asked && !robot.present ? text("stop_asked") : "", robot.present ? robot.note : ""].filter(Boolean).join(" · ");
}

function fill(card, robot) {
  const find = (selector) => card.querySelector(selector), {voltage, charge} = robot.battery ?? {};
  card.toggleAttribute("data-gone", !robot.present);
  card.dataset.need = robot.need;
  find(".dot").dataset.level = LEVELS[robot.need] ?? 2;
  find(".dot").title = text(TITLES[robot.need] || `need_${robot.need}`).replace(": {}", "").replace("{}", robot.name);
  write(find(".age"), age(robot.age));
  write(find(".charge"), (charge ?? null) !== null ? `${Math.round(100 * charge)} %` : voltage ? `${voltage.toFixed(1)} V` : "");
  write(find(".words"), words(robot));
  write(find(".now"), [robot.driven_by ? say("driven_by", robot.driven_by) : text("driven_by_nobody"),
    robot.speed ? `${robot.speed[0].toFixed(2)} m/s` : "", robot.frame === "map" ? "" : text("not_on_map")].filter(Boolean).join(" · "));
  for (const [selector, label] of [[".goal", "fleet_goal"], [".cancel", "cancel"], [".own", "fleet_page"]]) {
    write(find(selector), text(label));
    find(selector).setAttribute("aria-label", `${text(label)}: ${robot.name}`);
  }
  find(".goal").disabled = !robot.present || robot.frame !== "map";
  find(".cancel").disabled = !robot.present;
  find(".own").hidden = !robot.page;
  find(".own").href = robot.page || "#";
}

function named(names) {
  return names.slice(0, NAMED).join(", ") + (names.length > NAMED ? ` + ${names.length - NAMED}` : "");
}

function showStop() {
  const {all, stand, waiting, gone, left} = view.stop, asked = stand.length + waiting.length + gone.length, bar = $("stopping");
  bar.hidden = !(all || asked || left.length);
  bar.classList.toggle("done", !waiting.length && !gone.length);
  $("stop_all").setAttribute("aria-pressed", String(all));
  write($("stop_words"), [all || asked ? say("stop_holds", stand.length, asked) : "", waiting.length ? say("stop_waiting", named(waiting)) : "",
    gone.length ? say("stop_gone", named(gone)) : "", left.length ? say("stop_left", named(left)) : ""].filter(Boolean).join(" "));
}

function show() {
  const seen = new Set(view.robots.map(key));
  for (const one of [...cards.keys()].filter((one) => !seen.has(one))) {
    cards.delete(one);
  }
  for (const robot of view.robots) {
    if (!cards.has(key(robot))) {
      cards.set(key(robot), makeCard(robot));
    }
    fill(cards.get(key(robot)), robot);
  }
  const shown = view.robots.map((robot) => cards.get(key(robot))), before = [...$("robots").children];
  const others = shown.length !== before.length || shown.some((card) => !before.includes(card));
  if (others || (performance.now() - touched > STILL && shown.some((card, place) => before[place] !== card))) {
    $("robots").replaceChildren(...shown);  // not from under a finger
  }
  const present = view.robots.filter((robot) => robot.present).length;
  write($("count"), say("connected", present, view.robots.length));
  $("need").hidden = !view.need;
  write($("need"), say("need", view.need));
  $("none").hidden = view.robots.length > 0;
  showStop();
  const onMap = view.robots.some((robot) => robot.frame === "map") || Boolean(view.ground);
  $("stage").hidden = !onMap;
  document.querySelector("main").classList.toggle("mapped", onMap);
  draw(view, shortNames(view.robots.map((robot) => robot.name)), (robot) => key(robot) === aiming);
}

async function ask() {
  if (asking) {
    return;
  }
  asking = true;
  try {
    const answer = await fetch("robots", {signal: AbortSignal.timeout(PATIENCE)});
    if (answer.status === 401 && !unsent.size) {
      location.reload();
    }
    view = answer.ok ? await answer.json() : view;
    heard = answer.ok ? performance.now() : heard;
    show();
  } catch { /* the bar says so */ }
  asking = false;
  showLost();
}

function showLost() {
  const lost = performance.now() - heard > OLD;
  $("lost").hidden = !lost;
  document.body.classList.toggle("old", lost);
}

addTexts(FLEET_TEXTS);
languageList($("language"), () => view && show());
$("stop_all").onclick = () => stop();
actWhenHeld($("release"), (newest) => order({kind: "release", newest}), () => view.stop.newest);
$("map").onclick = (event) => {
  const robot = view.robots.find((one) => key(one) === aiming);
  if (robot) {
    const [x, y] = world.place(event.clientX, event.clientY);
    order({kind: "goal", name: robot.name, id: robot.id, seen: robot.number, x, y});
    aim(null);
  }
};
for (const event of ["pointerdown", "pointermove"]) {
  $("robots").addEventListener(event, () => touched = performance.now());
}
document.addEventListener("keydown", (event) => event.key === "Escape" && aim(null));
window.addEventListener("beforeunload", (event) => unsent.size && event.preventDefault());
new ResizeObserver(() => view && show()).observe($("map"));
setInterval(() => {
  ask();
  showLost();
}, PERIOD);
ask();
