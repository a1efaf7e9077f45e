// Every text of the page: English, German, Estonian.
const LANGUAGES = ["en", "de", "et"];
const TEXTS = {
  battery: ["Battery", "Akku", "Aku"],
  all_well: ["All is well", "Alles in Ordnung", "Kõik on korras"],
  board: ["Board", "Platine", "Juhtplaat"],
  camera: ["Camera", "Kamera", "Kaamera"],
  cancel: ["Cancel the goal", "Ziel abbrechen", "Tühista sihtkoht"],
  cap: ["Speed", "Tempo", "Kiirus"],
  caption_move: ["Drive", "Fahren", "Sõida"],
  caption_stop: ["Space", "Leertaste", "Tühik"],
  caption_turn: ["Turn", "Drehen", "Pööra"],
  closer: ["Closer", "Näher", "Lähemale"],
  details: ["Details", "Einzelheiten", "Üksikasjad"],
  distances: ["Distances", "Abstände", "Kaugused"],
  fault_barred: ["The robot waits until all have stopped once: let go of the stick, or end the program and start it again",
    "Der Roboter wartet, bis alle einmal angehalten haben: Stick loslassen, oder das Programm beenden und neu starten",
    "Robot ootab, kuni kõik on korra peatunud: lase juhtkang lahti või lõpeta programm ja käivita see uuesti"],
  "fault_black box": ["", "Die Aufzeichnung verliert Daten: Ist die Platte voll?", "Salvestus kaotab andmeid: kas ketas on täis?"],
  fault_battery: ["Nearly empty: charge it soon", "Fast leer: bald laden", "Peaaegu tühi: lae varsti"],
  fault_board: ["", "Die Platine meldet einen Fehler: Motoren, Kabel und Akku ansehen",
    "Juhtplaat teatab veast: vaata mootoreid, kaableid ja akut"],
  "fault_command stream": ["", "Fahrbefehle bleiben aus oder werden abgelehnt", "Sõidukäske ei tule või need lükatakse tagasi"],
  fault_gamepad: ["", "Das Gamepad fehlt oder schweigt", "Mängupult puudub või ei vasta"],
  fault_guard: ["", "Etwas ist im Weg", "Midagi on ees"],
  fault_gyro: ["", "Der Drehratensensor fehlt oder misst falsch", "Güroskoop puudub või mõõdab valesti"],
  fault_link: ["", "Die Platine antwortet nicht: Steckt das Kabel? Ist sie eingeschaltet?",
    "Juhtplaat ei vasta: kas kaabel on küljes? Kas see on sisse lülitatud?"],
  fault_localization: ["", "Der Roboter weiß nicht sicher, wo er ist", "Robot ei tea kindlalt, kus ta on"],
  "fault_real time": ["", "Die Simulation ist zu langsam für diesen Rechner", "Simulatsioon on selle arvuti jaoks liiga aeglane"],
  fault_stamps: ["", "Die Uhr wurde verstellt", "Kella on muudetud"],
  "fault_web page": ["", "Die fahrende Seite schwieg: einmal loslassen", "Juhtiv leht vaikis: lase korraks lahti"],
  "fault_wheel feedback": ["", "Ein Rad dreht nicht wie befohlen oder meldet sich nicht",
    "Mõni ratas ei pöörle käsu järgi või ei anna märku"],
  "fault_who drives": ["", "Mehrere wollen fahren, oder jemand umgeht die Auswahl", "Mitu juhti korraga või keegi läheb valikust mööda"],
  farther: ["Farther", "Weiter weg", "Kaugemale"],
  give_back: ["Give back", "Zurückgeben", "Anna tagasi"],
  goal: ["Send to a place", "Zu einem Ort schicken", "Saada sihtkohta"],
  goal_hint: ["Tap a place on the map", "Ort auf der Karte antippen", "Puuduta kaardil kohta"],
  hands_off: ["Let go once, then drive on", "Einmal loslassen, dann weiterfahren", "Lase korraks lahti, siis sõida edasi"],
  health: ["Health", "Zustand", "Seisund"],
  language: ["Language", "Sprache", "Keel"],
  late: ["Came too late: try again", "Kam zu spät: noch einmal", "Jõudis liiga hilja: proovi uuesti"],
  level_error: ["Error", "Fehler", "Viga"],
  level_ok: ["Well", "In Ordnung", "Korras"],
  level_silent: ["Silent for 5 s: has it ended?", "Seit 5 s still: Ist es beendet?", "5 s vait: kas see on lõppenud?"],
  level_warning: ["Warning", "Warnung", "Hoiatus"],
  "light_black box": ["Recording", "Aufzeichnung", "Salvestus"],
  light_battery: ["Battery", "Akku", "Aku"],
  light_board: ["Board", "Platine", "Juhtplaat"],
  "light_command stream": ["Commands", "Fahrbefehle", "Sõidukäsud"],
  light_gamepad: ["Gamepad", "Gamepad", "Mängupult"],
  light_guard: ["Obstacles", "Hindernisse", "Takistused"],
  light_gyro: ["Gyro", "Drehratensensor", "Güroskoop"],
  light_link: ["Link to the board", "Verbindung zur Platine", "Ühendus juhtplaadiga"],
  light_localization: ["Place on the map", "Ort auf der Karte", "Asukoht kaardil"],
  "light_real time": ["Simulator's speed", "Tempo der Simulation", "Simulaatori kiirus"],
  light_stamps: ["Clock", "Uhr", "Kell"],
  "light_web page": ["Web page", "Webseite", "Veebileht"],
  "light_wheel feedback": ["Wheels", "Räder", "Rattad"],
  "light_who drives": ["Who drives", "Wer fährt", "Kes juhib"],
  lost: ["No connection", "Keine Verbindung", "Ühendus puudub"],
  lost_advice: ["No connection: does the robot run, and is this device in its network?",
    "Keine Verbindung: Läuft der Roboter, und ist dieses Gerät in seinem Netz?",
    "Ühendus puudub: kas robot töötab ja kas see seade on tema võrgus?"],
  map: ["Map", "Karte", "Kaart"],
  move: ["Drive: ahead, back, left, right; keys W, S, A, D", "Fahren: vor, zurück, links, rechts; Tasten W, S, A, D",
    "Sõida: edasi, tagasi, vasakule, paremale; klahvid W, S, A, D"],
  no_reports: ["The robot reports nothing", "Der Roboter meldet nichts", "Robot ei teata midagi"],
  not_driver: ["Take over first", "Erst übernehmen", "Võta enne juhtimine üle"],
  open: ["Open", "Öffnen", "Ava"],
  pages: ["Open pages", "Offene Seiten", "Avatud lehti"],
  release: ["Hold 1 s to release", "Zum Lösen 1 s halten", "Vabastamiseks hoia 1 s"],
  reset_odometry: ["Reset odometry", "Odometrie nullen", "Nulli odomeetria"],
  round_trip: ["Round trip to the robot", "Hin und zurück zum Roboter", "Edasi-tagasi aeg robotini"],
  slow: ["The connection stalls", "Die Verbindung stockt", "Ühendus takerdub"],
  some_bad: ["Look here", "Hier nachsehen", "Vaata siia"],
  stop_label: ["Emergency stop; key Space or Escape", "Not-Halt; Leertaste oder Escape", "Hädaseiskamine; tühik või Escape"],
  stop_waits: ["STOP has not reached the robot yet", "STOP ist noch nicht beim Roboter",
    "STOP pole veel robotini jõudnud"],
  stopped: ["Emergency stop", "Not-Halt", "Hädaseiskamine"],
  taken: ["Another page has taken over", "Eine andere Seite hat übernommen", "Teine leht võttis juhtimise üle"],
  take: ["Take over", "Übernehmen", "Võta üle"],
  token_hint: ["Token (in the terminal that serves this page; robot started at boot: sudo cat /var/lib/robotont/robotont_teleop_token)",
    "Token (steht im Terminal, das diese Seite liefert; startet der Roboter von selbst: sudo cat /var/lib/robotont/robotont_teleop_token)",
    "Token (terminalis, kust see leht tuleb; kui robot käivitub ise: sudo cat /var/lib/robotont/robotont_teleop_token)"],
  token_later: ["Too many wrong tokens: wait a minute", "Zu viele falsche Token: eine Minute warten",
    "Liiga palju valesid tokeneid: oota minut"],
  token_show: ["Show what I type", "Eingabe zeigen", "Näita sisestatut"],
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

// More texts, of another page of this server's
export function addTexts(more) {
  Object.assign(TEXTS, more);
}

export function text(key) {
  return TEXTS[key][language];
}

// The text of a key, or another one where there is none
export function textOr(key, other) {
  return TEXTS[key]?.[language] || other;
}

export function speaksEnglish() {
  return language === 0;
}
