// The panel: the nodes' health, the wheels' speeds, and what else the robot reports.
import {$, number, write} from "./page.js";
import {text, textOr} from "./texts.js";
import {byWorst} from "./truth.js";

export const LOW_CHARGE = 0.15;
const LEVELS = ["level_ok", "level_warning", "level_error", "fault_silent"];

// The name of a light as people say it; one of another's node keeps its own
export function nameOf(light) {
  const name = light.name.replace(/^.*: /, "");
  return textOr(`light_${name}`, name);
}

// What is wrong and what to do, in the page's language; "" for what has no sentence of its own
export function sentenceOf(light) {
  const distance = light.key === "in_the_way" ? light.words.match(/[\d.]+ m(?= from the robot)/)?.[0] : "";
  return [textOr(`fault_${light.key}`, ""), distance].filter(Boolean).join(": ");
}

// none: the key of what is said where there are none
export function showLights(lights, none) {
  const sorted = byWorst(lights);
  const bad = sorted.filter((light) => light.level > 0);
  $("worst").dataset.level = sorted.length ? sorted[0].level : 3;
  if (Number($("health").dataset.bad ?? 0) !== bad.length) {
    $("health").dataset.bad = bad.length;
    $("health").open = bad.length > 0;
  }
  write($("summary"), bad.length ? `${text("some_bad")}: ${bad.length} / ${lights.length}` :
    lights.length ? `${text("all_well")} (${lights.length})` : text(none));
  $("lights").replaceChildren(...sorted.map((light) => {
    const line = $("light").content.firstElementChild.cloneNode(true);
    const [dot, name, report, words] = line.children;
    dot.dataset.level = light.level;
    dot.setAttribute("aria-label", text(LEVELS[light.level] || "level_error"));
    name.textContent = nameOf(light);
    report.textContent = light.level ? sentenceOf(light) : "";
    words.textContent = light.words; // the robot's own, which are English
    return line;
  }));
}

// Speeds [m/s] of each wheel, null where unknown; bars reach `fastest` at both ends
export function showWheels(commanded, measured, fastest) {
  const box = $("wheels");
  const wanted = commanded || measured?.map(() => 0) || [...box.children].map(() => null);
  while (box.childElementCount < wanted.length) {
    box.append($("wheel").content.cloneNode(true));
    box.lastElementChild.firstElementChild.textContent = box.childElementCount - 1;
  }
  wanted.forEach((speed, wheel) => {
    const real = measured?.[wheel] ?? null;
    const row = box.children[wheel];
    setBar(row.querySelector("i.wanted"), (speed ?? 0) / fastest);
    setBar(row.querySelector("i.real"), (real ?? 0) / fastest);
    write(row.querySelector("span.wanted"), speed === null ? "–" : number(speed));
    write(row.querySelector("span.real"), real === null ? "–" : number(real));
  });
}

function setBar(bar, part) {
  const length = Math.max(-1, Math.min(1, part));
  bar.style.left = `${50 + Math.min(0, length) * 50}%`;
  bar.style.width = `${Math.abs(length) * 50}%`;
}

export function showFacts({board, battery, pages}) {
  const facts = [];
  const charge = battery?.charge == null ? "" : `${Math.round(battery.charge * 100)} % `;
  const voltage = battery?.voltage == null ? "" : `${battery.voltage.toFixed(1)} V`;
  $("battery").hidden = !(charge || voltage);
  write($("charge"), charge || voltage);
  $("battery").dataset.low = battery?.charge != null && battery.charge <= LOW_CHARGE;
  if (charge || voltage) {
    facts.push(["battery", charge + voltage]);
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
