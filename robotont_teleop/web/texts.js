// Every text of the page: English, German, Estonian.
const LANGUAGES = ["en", "de", "et"];
const TEXTS = {
  battery: ["Battery", "Akku", "Aku"],
  board: ["Board", "Platine", "Juhtplaat"],
  camera: ["Camera", "Kamera", "Kaamera"],
  cancel: ["Cancel the goal", "Ziel abbrechen", "Tühista sihtkoht"],
  cap: ["Speed", "Tempo", "Kiirus"],
  closer: ["Closer", "Näher", "Lähemale"],
  details: ["Details", "Einzelheiten", "Üksikasjad"],
  distances: ["Distances", "Abstände", "Kaugused"],
  farther: ["Farther", "Weiter weg", "Kaugemale"],
  give_back: ["Give back", "Zurückgeben", "Anna tagasi"],
  goal: ["Send to a place", "Zu einem Ort schicken", "Saada sihtkohta"],
  goal_hint: ["Tap a place on the map", "Ort auf der Karte antippen", "Puuduta kaardil kohta"],
  hands_off: ["Let go once, then drive on", "Einmal loslassen, dann weiterfahren", "Lase korraks lahti, siis sõida edasi"],
  health: ["Health", "Zustand", "Seisund"],
  language: ["Language", "Sprache", "Keel"],
  late: ["Came too late: try again", "Kam zu spät: noch einmal", "Jõudis liiga hilja: proovi uuesti"],
  lost: ["No connection", "Keine Verbindung", "Ühendus puudub"],
  move: ["Drive: ahead, back, left, right; keys W, S, A, D", "Fahren: vor, zurück, links, rechts; Tasten W, S, A, D",
    "Sõida: edasi, tagasi, vasakule, paremale; klahvid W, S, A, D"],
  not_driver: ["Take over first", "Erst übernehmen", "Võta enne juhtimine üle"],
  open: ["Open", "Öffnen", "Ava"],
  pages: ["Open pages", "Offene Seiten", "Avatud lehti"],
  release: ["Hold to release", "Zum Lösen halten", "Vabastamiseks hoia all"],
  reset_odometry: ["Reset odometry", "Odometrie nullen", "Nulli odomeetria"],
  round_trip: ["Round trip to the robot", "Hin und zurück zum Roboter", "Edasi-tagasi aeg robotini"],
  slow: ["The connection stalls", "Die Verbindung stockt", "Ühendus takerdub"],
  stop_label: ["Emergency stop; key Space or Escape", "Not-Halt; Leertaste oder Escape", "Hädaseiskamine; tühik või Escape"],
  stop_waits: ["STOP has not reached the robot yet", "STOP ist noch nicht beim Roboter",
    "STOP pole veel robotini jõudnud"],
  stopped: ["Emergency stop", "Not-Halt", "Hädaseiskamine"],
  take: ["Take over", "Übernehmen", "Võta üle"],
  token_hint: ["Token (the robot's terminal shows it)", "Token (steht im Terminal des Roboters)",
    "Token (roboti terminalis)"],
  token_later: ["Too many wrong tokens: wait a minute", "Zu viele falsche Token: eine Minute warten",
    "Liiga palju valesid tokeneid: oota minut"],
  token_wrong: ["Wrong token", "Falsches Token", "Vale token"],
  turn: ["Turn left or right; keys Q, E", "Links oder rechts drehen; Tasten Q, E", "Pööra vasakule või paremale; klahvid Q, E"],
  view: ["The robot from above", "Der Roboter von oben", "Robot pealtvaates"],
  wheels: ["Wheels: commanded and measured", "Räder: Soll und Ist", "Rattad: käsk ja mõõdetud"],
  who_default: ["A program drives", "Ein Programm fährt", "Juhib programm"],
  who_hand: ["Driven by hand", "Von Hand gefahren", "Juhitakse käsitsi"],
  who_navigation: ["Navigation drives", "Navigation fährt", "Juhib navigatsioon"],
  who_nobody: ["Nobody drives", "Niemand fährt", "Keegi ei juhi"],
  who_other: ["Another page drives", "Eine andere Seite fährt", "Juhib teine leht"],
  who_you: ["You drive", "Du fährst", "Sina juhid"],
  who_you_navigation: ["Navigation drives, you can take it", "Navigation fährt, du kannst übernehmen",
    "Juhib navigatsioon, saad üle võtta"],
};

let language = 0;

export function chosenLanguage() {
  let saved = null;
  try {
    saved = localStorage.getItem("language");
  } catch {
    // no storage: the browser's language
  }
  const wishes = [saved, ...navigator.languages].filter(Boolean).map((wish) => wish.slice(0, 2));
  return wishes.find((wish) => LANGUAGES.includes(wish)) || "en";
}

export function setLanguage(code) {
  language = Math.max(0, LANGUAGES.indexOf(code));
  document.documentElement.lang = LANGUAGES[language];
  for (const element of document.querySelectorAll("[data-text]")) {
    element.textContent = text(element.dataset.text);
  }
  for (const element of document.querySelectorAll("[data-title]")) {
    element.title = text(element.dataset.title);
  }
  for (const element of document.querySelectorAll("[data-label]")) {
    element.setAttribute("aria-label", text(element.dataset.label));
    element.title = element.tagName === "BUTTON" ? text(element.dataset.label) : "";
  }
}

export function text(key) {
  return TEXTS[key][language];
}
