// The camera's newest picture, one after another, on a connection of its own: a slow line shows fewer, and no command
// waits.
import {$} from "./page.js";

const RETRY = 500; // [ms]

export function toggleCamera() {
  const on = !isOn();
  $("film").setAttribute("aria-pressed", on);
  $("camera").hidden = !on;
  if (on) {
    film();
  }
}

const isOn = () => $("film").getAttribute("aria-pressed") === "true";

async function film() {
  let after = 0;
  while (isOn()) {
    try {
      const response = await fetch(`camera.jpg?after=${after}`, {cache: "no-store", priority: "low"});
      if (response.ok && !document.hidden) {
        after = response.headers.get("X-Picture");
        await showPicture(new Uint8Array(await response.arrayBuffer()));
        continue;
      }
    } catch {
      // no connection: try again
    }
    $("camera").removeAttribute("src"); // an old picture must not look like one of now
    await new Promise((resolve) => setTimeout(resolve, RETRY));
  }
}

async function showPicture(bytes) {
  const address = URL.createObjectURL(new Blob([bytes], {type: "image/jpeg"}));
  $("camera").src = address;
  await $("camera").decode().catch(() => null);
  URL.revokeObjectURL(address);
}
