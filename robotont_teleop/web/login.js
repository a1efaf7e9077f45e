// Sends the token once; the server answers with a cookie that no script can read.
import {$} from "./page.js";
import {text} from "./texts.js";

async function logIn(token) {
  const response = await fetch("login", {method: "POST", body: new URLSearchParams({token}), redirect: "manual"});
  if (response.type === "opaqueredirect" || response.ok) {
    location.replace("./");
    return;
  }
  $("answer").textContent = text("token_wrong");
  $("answer").hidden = false;
}

$("form").addEventListener("submit", (event) => {
  event.preventDefault();
  logIn($("token").value.trim());
});

// The QR code carries the token behind #, which browsers send to no server.
const shown = new URLSearchParams(location.hash.slice(1)).get("token");
if (shown) {
  history.replaceState(null, "", location.pathname);
  logIn(shown);
}
