// The browser sends the form; the server answers a wrong token with this page again, at the form's address.
import {$} from "./page.js";
import "./texts.js";

$("answer").hidden = !location.pathname.endsWith("/login");

addEventListener("pagehide", () => $("form").reset()); // a step back in a lent browser shows no token

// The QR code carries the token behind #, which browsers send to no server.
const shown = new URLSearchParams(location.hash.slice(1)).get("token");
if (shown) {
  history.replaceState(null, "", location.pathname);
  $("token").value = shown;
  $("form").submit();
}
