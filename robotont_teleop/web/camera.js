// The camera's newest picture, one after another, on a connection of its own: a slow line shows fewer, and no command
// waits. There is one loop for the life of the page.
import {$} from "./page.js";

const RETRY = 500;  // [ms]
const STALE = 1000; // [ms] an older picture would look like one of now
const wait = (time) => new Promise((resolve) => setTimeout(resolve, time));

let end = null; // timer of the picture that is shown

// wanted(): whether to show it
export async function film(wanted) {
  let after = 0;
  for (;;) {
    const picture = wanted() && !document.hidden ? await fetchPicture(after) : null;
    if (picture) {
      after = picture.number;
      await showPicture(picture.blob);
    } else {
      hide();
      await wait(RETRY);
    }
  }
}

async function fetchPicture(after) {
  try {
    const response = await fetch(`camera.jpg?after=${after}`, {cache: "no-store", priority: "low"});
    return response.ok ? {number: response.headers.get("X-Picture"), blob: await response.blob()} : null;
  } catch {
    return null; // no connection: try again
  }
}

async function showPicture(blob) {
  const address = URL.createObjectURL(blob);
  $("camera").src = address;
  await $("camera").decode().catch(() => null);
  URL.revokeObjectURL(address);
  clearTimeout(end);
  end = setTimeout(hide, STALE);
}

function hide() {
  $("camera").removeAttribute("src");
}
