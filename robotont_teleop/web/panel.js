// The panel: the nodes' health, and what else the robot reports; and the bar with the worst fault.
import {$, chargeOf, write} from "./page.js";
import {text} from "./texts.js";

const LEVELS = ["level_ok", "level_warning", "level_error", "fault_silent"];

// The name of a light as people say it; one of another's node keeps its own
function nameOf(light) {
  const name = light.name.replace(/^.*: /, "");
  return text(`light_${name}`) || name;
}

// What is wrong and what to do, in the page's language; "" for what has no sentence of its own
function sentenceOf(light) {
  return text(`fault_${light.key}`) || text(light.key);
}

// A light, or null
export function showFault(fault) {
  $("fault").hidden = !fault;
  if (fault) {
    const sentence = sentenceOf(fault);
    $("fault").dataset.level = fault.level;
    write($("fault_name"), nameOf(fault));
    write($("fault_words"), sentence || fault.words);
    $("fault_words").lang = sentence ? "" : "en";
  }
}

// lights: the worst first; none: what is said where there are none
export function showLights(lights, none) {
  const bad = lights.filter((light) => light.level > 0).length;
  write($("summary"), bad ? `${text("some_bad")}: ${bad} / ${lights.length}` :
    lights.length ? `${text("all_well")} (${lights.length})` : none);
  $("lights").replaceChildren(...lights.map((light) => {
    const line = $("light").content.firstElementChild.cloneNode(true);
    const [dot, {children: [name, report, words]}] = line.children;
    dot.dataset.level = light.level;
    dot.ariaLabel = text(LEVELS[light.level] ?? "level_error");
    name.textContent = nameOf(light);
    report.textContent = light.level ? sentenceOf(light) : "";
    words.textContent = light.words; // the robot's own, which are English
    return line;
  }));
}

export function showFacts({battery, lights}) {
  write($("charge"), chargeOf(battery));
  $("battery").hidden = !chargeOf(battery);
  $("battery").dataset.low = Boolean(lights?.some(({key}) => key === "battery_low"));
  write($("facts"), battery?.voltage != null ? `${battery.voltage.toFixed(1)} V` : "");
}
