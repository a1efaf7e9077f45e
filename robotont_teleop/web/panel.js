// The panel: the nodes' health, the wheels' speeds, and what else the robot reports.
import {$, number, write} from "./page.js";
import {text} from "./texts.js";

const LEVELS = ["OK", "WARN", "ERROR", "STALE"];

export function showLights(lights) {
  $("worst").dataset.level = Math.max(0, ...lights.map((light) => light.level));
  $("lights").replaceChildren(...lights.map(({name, level, words}) => {
    const line = document.createElement("li");
    const dot = document.createElement("span");
    dot.className = "dot";
    dot.dataset.level = level;
    dot.setAttribute("role", "img");
    dot.setAttribute("aria-label", LEVELS[level] || "ERROR");
    const title = document.createElement("b");
    title.textContent = name.replace(/^.*: /, "");
    const report = document.createElement("span");
    report.textContent = words;
    line.append(dot, title, report);
    return line;
  }));
}

// Speeds [m/s] of each wheel, null where unknown; bars reach `fastest` at both ends
export function showWheels(commanded, measured, fastest) {
  const wanted = commanded || measured?.map(() => 0) || [];
  const box = $("wheels");
  while (box.childElementCount < wanted.length) {
    const row = document.createElement("div");
    row.innerHTML = '<span class="bar"><i class="wanted"></i><i class="real"></i></span>' +
      '<span class="wanted"></span><span class="real"></span><span>m/s</span>';
    box.append(row);
  }
  wanted.forEach((speed, wheel) => {
    const real = measured?.[wheel] ?? null;
    const row = box.children[wheel];
    setBar(row.querySelector("i.wanted"), speed / fastest);
    setBar(row.querySelector("i.real"), (real ?? 0) / fastest);
    write(row.querySelector("span.wanted"), number(speed));
    write(row.querySelector("span.real"), real === null ? "–" : number(real));
  });
}

function setBar(bar, part) {
  const length = Math.max(-1, Math.min(1, part));
  bar.style.left = `${50 + Math.min(0, length) * 50}%`;
  bar.style.width = `${Math.abs(length) * 50}%`;
}

export function showFacts({board, battery, ranges, pages}) {
  const facts = [];
  const charge = battery?.charge == null ? "" : `${Math.round(battery.charge * 100)} % `;
  const voltage = battery?.voltage == null ? "" : `${battery.voltage.toFixed(1)} V`;
  $("battery").hidden = !(charge || voltage);
  write($("charge"), charge || voltage);
  if (charge || voltage) {
    facts.push(["battery", charge + voltage]);
  }
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
