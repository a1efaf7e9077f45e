// The fleet's page: asks for all robots twice a second, and sends orders. What a robot says is shown as text only.
import {draw, world} from "./fleet_map.js";
import {$, write} from "./page.js";

const PERIOD = 500, PATIENCE = 3000;  // [ms] between two questions; an answer may take
const LEVELS = ["well", "warning", "error", "silent"];
const cards = new Map();
let view = null, heard = -Infinity, aiming = null;

async function order(fields) {
  try {
    const answer = await fetch("order", {method: "POST", body: JSON.stringify(fields), signal: AbortSignal.timeout(PATIENCE)});
    $("lost").hidden = answer.ok;
  } catch {
    $("lost").hidden = false;
  }
  ask();
}

function aim(robot) {
  aiming = robot && aiming?.id !== robot.id ? {id: robot.id, name: robot.name} : null;
  $("choosing").hidden = !aiming;
  $("choosing").textContent = aiming ? `Tap the place on the map to which ${aiming.name} shall go.` : "";
  document.body.classList.toggle("aiming", Boolean(aiming));
  for (const [id, card] of cards) {
    card.querySelector(".goal").setAttribute("aria-pressed", String(aiming?.id === id));
  }
  if (aiming) {
    $("stage").scrollIntoView({block: "center"});
  }
}

function makeCard(robot) {
  const card = $("card").content.firstElementChild.cloneNode(true);
  const find = (selector) => card.querySelector(selector);
  find("h2").textContent = robot.name;
  for (const [selector, what] of [[".one", "STOP"], [".goal", "Goal for"], [".cancel", "Cancel the goal of"], [".own", "Page of"]]) {
    find(selector).setAttribute("aria-label", `${what} ${robot.name}`);
  }
  find(".one").onclick = () => order({kind: "stop", name: robot.name});
  find(".cancel").onclick = () => order({kind: "cancel", name: robot.name});
  find(".goal").onclick = () => aim(robot);
  return card;
}

function age(seconds) {
  return seconds === null ? "nothing yet" : seconds < 3 ? "now" : seconds < 100 ? `${Math.round(seconds)} s ago`
    : seconds < 6000 ? `${Math.round(seconds / 60)} min ago` : `${Math.round(seconds / 3600)} h ago`;
}

function words(robot) {
  return robot.namesakes ? `Two robots are called ${robot.name}: rename one` : !robot.present ? "No connection: this is what it said last"
    : robot.silent ? "Connected, but its fleet_node says nothing" : robot.stopping ? "STOP sent, not confirmed yet"
    : robot.stopped ? `Emergency stop, pressed by ${robot.stopped}; release it on the robot's own page` : robot.note
    || (robot.worst?.[0] ? `${robot.worst[1]}: ${robot.worst[2]}` : "");
}

function fill(card, robot) {
  const find = (selector) => card.querySelector(selector);
  const level = !robot.present || robot.silent ? 3 : robot.namesakes || robot.stopped ? 2 : robot.worst?.[0] ?? 3;
  card.toggleAttribute("data-gone", !robot.present);
  card.toggleAttribute("data-stopped", Boolean(robot.stopped || robot.stopping));
  find(".dot").dataset.level = level;
  find(".dot").title = LEVELS[level];
  find(".age").textContent = age(robot.age);
  const {voltage, charge} = robot.battery ?? {};
  find(".charge").textContent = (charge ?? null) !== null ? `${Math.round(100 * charge)} %${charge <= 0.05 ? ", empty" : charge <= 0.15 ? ", low" : ""}` : voltage ? `${voltage.toFixed(1)} V` : "";
  find(".words").textContent = words(robot);
  find(".now").textContent = [robot.driven_by ? `driven by ${robot.driven_by}` : "nobody drives",
    robot.speed ? `${robot.speed[0].toFixed(2)} m/s` : "", robot.frame === "map" ? "" : "not on the map"].filter(Boolean).join(" · ");
  find(".goal").disabled = !robot.present || robot.frame !== "map";
  find(".cancel").disabled = find(".one").disabled = !robot.present;
  find(".own").hidden = !robot.page;
  find(".own").href = robot.page || "#";
}

function show() {
  for (const robot of view.robots) {
    if (!cards.has(robot.id)) {
      cards.set(robot.id, makeCard(robot));
    }
    fill(cards.get(robot.id), robot);
  }
  const shown = view.robots.map((robot) => cards.get(robot.id));
  if (shown.some((card, place) => $("robots").children[place] !== card) || shown.length !== $("robots").children.length) {
    $("robots").replaceChildren(...shown);
  }
  const present = view.robots.filter((robot) => robot.present).length;
  write($("count"), `${present} of ${view.robots.length} connected`);
  $("none").hidden = view.robots.length > 0;
  const {asked, stand, waiting, gone} = view.stop, bar = $("stopping");
  bar.hidden = !asked;
  bar.classList.toggle("done", !waiting.length && !gone.length);
  write(bar, `STOP: ${stand} of ${asked} have confirmed.` + (waiting.length ? ` Still asking ${waiting.join(", ")}.` : "")
    + (gone.length ? ` Gone before: ${gone.join(", ")}.` : ""));
  const onMap = view.robots.some((robot) => robot.frame === "map") || Boolean(view.ground);
  $("stage").hidden = !onMap;
  document.querySelector("main").classList.toggle("mapped", onMap);
  draw(view, aiming?.id);
}

async function ask() {
  try {
    const answer = await fetch("robots", {signal: AbortSignal.timeout(PATIENCE)});
    if (answer.status === 401) {
      location.reload();
    }
    view = await answer.json();
    heard = performance.now();
    show();
  } catch { /* the bar says so */ }
  $("lost").hidden = performance.now() - heard < PATIENCE;
}

$("stop_all").onclick = () => order({kind: "stop"});
$("map").onclick = (event) => {
  const robot = view.robots.find((one) => one.id === aiming?.id);
  if (robot) {
    const [x, y] = world.place(event.clientX, event.clientY);
    order({kind: "goal", name: robot.name, id: robot.id, seen: robot.number, x, y});
    aim(null);
  }
};
document.addEventListener("keydown", (event) => event.key === "Escape" && aim(null));
setInterval(ask, PERIOD);
ask();
