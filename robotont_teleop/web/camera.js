// The camera's newest picture, one after another, on a connection of its own: a slow line shows fewer, and no command
// waits. There is one loop for the life of the page.
import {$} from "./page.js";

const RETRY = 500;  // [ms]
const STALE = 1000; // [ms] an older picture would look like one of now

// wanted(): whether to show it
export async function film(wanted) {
  const hide = () => $("camera").removeAttribute("src");
  let after = 0, end = null; // the number of the newest picture, and the timer of its end
  for (;;) {
    const answer = wanted() && !document.hidden &&
      await fetch(`camera.jpg?after=${after}`, {cache: "no-store", priority: "low"}).catch(() => null);
    const picture = answer?.ok && await answer.blob().catch(() => null);
    if (picture) {
      after = answer.headers.get("X-Picture");
      const address = URL.createObjectURL(picture);
      $("camera").src = address;
      await $("camera").decode().catch(() => null);
      URL.revokeObjectURL(address);
      clearTimeout(end);
      end = setTimeout(hide, STALE);
    } else {
      hide();
      await new Promise((resolve) => setTimeout(resolve, RETRY));
    }
  }
}
