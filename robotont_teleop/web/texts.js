// Every text of the page: English, German, Estonian. Faults by their key, of hand/fault_keys.py.
const LANGUAGES = {en: "English", de: "Deutsch", et: "Eesti"};
export const TEXTS = {
  all_well: ["All is well", "Alles in Ordnung", "Kõik on korras"],
  battery: ["Battery", "Akku", "Aku"],
  board: ["Board", "Platine", "Juhtplaat"],
  camera: ["Camera", "Kamera", "Kaamera"],
  can_drive: ["Push a stick to drive", "Zum Fahren Stick bewegen", "Sõitmiseks lükka kangi"],
  can_let_go: ["Let go of the sticks once", "Sticks einmal loslassen", "Lase korraks lahti"],
  can_mix: ["Careful: a stick adds to it", "Vorsicht: Stick mischt sich ein", "Ettevaatust: kang lisandub"],
  can_no_board: ["No board: sticks are off", "Keine Platine: Sticks aus", "Plaati pole: juhtkangid väljas"],
  can_no_mux: ["No cmd_vel_mux: sticks are off", "Kein cmd_vel_mux: Sticks aus",
    "cmd_vel_mux puudub: juhtkangid väljas"],
  can_nothing: ["Sticks are off", "Sticks aus", "Juhtkangid väljas"],
  can_release: ["Sticks wait for the release", "Sticks warten auf das Lösen", "Juhtkangid ootavad"],
  can_stop: ["Let go to stop", "Zum Anhalten loslassen", "Peatumiseks lase lahti"],
  can_take_it: ["A stick takes it over", "Ein Stick übernimmt", "Juhtkang võtab üle"],
  can_take_over: ["Take over first", "Erst übernehmen", "Võta enne üle"],
  can_wait: ["The connection stalls", "Die Verbindung stockt", "Ühendus takerdub"],
  cancel: ["Cancel the goal", "Ziel abbrechen", "Tühista siht"],
  caption_move: ["Drive", "Fahren", "Sõida"],
  caption_stop: ["Space", "Leertaste", "Tühik"],
  caption_turn: ["Turn", "Drehen", "Pööra"],
  chips: ["Speed; keys 1, 2, 3", "Tempo; Tasten 1, 2, 3", "Kiirus; klahvid 1, 2, 3"],
  closer: ["Closer", "Näher", "Lähemale"],
  details: ["Details", "Einzelheiten", "Üksikasjad"],
  farther: ["Farther", "Weiter weg", "Kaugemale"],
  fast: ["Fast", "Schnell", "Kiire"],
  fault_barred: ["It waits until all have stopped once: let go, or end the program",
    "Er wartet auf einen Halt: loslassen oder Programm beenden", "Ootab peatumist: lase lahti või lõpeta programm"],
  fault_battery_low: ["Battery nearly empty: charge it", "Akku fast leer: laden", "Aku peaaegu tühi: lae"],
  fault_board_fault: ["The board reports a motor's fault: look at the cables",
    "Platine meldet Motorfehler: Kabel ansehen", "Juhtplaat teatab mootori veast: vaata kaableid"],
  fault_board_silent: ["Board silent: is it switched on?", "Platine schweigt: Ist sie an?",
    "Juhtplaat vaikib: kas see on sees?"],
  fault_board_unknown: ["Is this another robot's board?", "Platine eines anderen Roboters?",
    "Kas see on teise roboti plaat?"],
  fault_clock_set: ["The clock was set", "Die Uhr wurde verstellt", "Kella on muudetud"],
  fault_guard_blind: ["Sensors have blind spots: take care", "Tote Winkel: vorsichtig fahren",
    "Pimealad: sõida ettevaatlikult"],
  fault_gyro_unused: ["The gyro is not used", "Der Drehratensensor wird nicht verwendet", "Güroskoopi ei kasutata"],
  fault_in_the_way: ["Something is in the way", "Etwas ist im Weg", "Midagi on ees"],
  fault_line_noisy: ["The board's cable loses data", "Platinenkabel verliert Daten", "Plaadi kaabel kaotab andmeid"],
  fault_lost: ["Unsure where it is: show its place", "Ort unsicher: Ort zeigen", "Asukoht ebakindel: näita kohta"],
  fault_no_map: ["There is no map", "Es gibt keine Karte", "Kaarti pole"],
  fault_no_scan: ["Scanner silent: does it run?", "Scanner schweigt: Läuft er?", "Skanner vaikib: kas see töötab?"],
  fault_other_publisher: ["A program drives past the mux: let it use cmd_vel/default",
    "Programm umgeht die Auswahl: Es soll cmd_vel/default nehmen",
    "Programm läheb valikust mööda: kasutagu see cmd_vel/default"],
  fault_other_sender: ["Two want to drive at once: the first one does", "Zwei wollen zugleich fahren: Der erste fährt",
    "Kaks tahavad korraga juhtida: juhib esimene"],
  fault_pad_gone: ["Gamepad still, or out of reach: move a stick", "Gamepad still oder zu weit weg: Stick bewegen",
    "Mängupult paigal või levist väljas: liiguta kangi"],
  fault_pad_missing: ["No gamepad: plug it in", "Kein Gamepad: einstecken", "Mängupulti pole: ühenda see"],
  fault_page_let_go: ["The driving page fell silent: let go once", "Die fahrende Seite schwieg: einmal loslassen",
    "Juhtiv leht vaikis: lase korraks lahti"],
  fault_port_forbidden: ["This user may not use the board: group dialout",
    "Benutzer darf nicht an die Platine: Gruppe dialout", "Kasutajal pole plaadile õigust: grupp dialout"],
  fault_port_missing: ["The board's cable is out, or the board is off",
    "Das Kabel der Platine steckt nicht, oder sie ist aus", "Juhtplaadi kaabel on lahti või plaat on väljas"],
  fault_port_taken: ["Another program has the board: end it", "Ein anderes Programm hat die Platine: beenden",
    "Juhtplaat on teise programmi käes: lõpeta see"],
  fault_program_fault: ["A program's fault: please report", "Programmfehler: bitte melden",
    "Programmi viga: palun teata"],
  fault_recording_lost: ["Recording: is the disk full?", "Aufzeichnung: Platte voll?", "Salvestus: kas ketas on täis?"],
  fault_refused: ["A command was refused: a program sends nonsense",
    "Ein Fahrbefehl wurde abgelehnt: Ein Programm sendet Unsinn", "Sõidukäsk lükati tagasi: programm saadab jama"],
  fault_silent: ["Silent for 5 s: has it ended?", "Seit 5 s still: Ist es beendet?", "5 s vait: kas see on lõppenud?"],
  fault_slow_computer: ["This computer is too slow", "Dieser Rechner ist zu langsam", "See arvuti on liiga aeglane"],
  fault_wheel_blocked: ["A wheel does not turn as told: is it blocked?",
    "Ein Rad dreht nicht wie befohlen: Ist es blockiert?", "Ratas ei pöörle käsu järgi: kas see on kinni?"],
  fault_wheel_slips: ["A wheel slips: place uncertain", "Ein Rad rutscht: Ort unsicher",
    "Ratas libiseb: koht ebakindel"],
  fault_wheels_silent: ["Wheels say nothing: see the board", "Räder stumm: siehe Platine",
    "Rattad vaikivad: vaata plaati"],
  give_back: ["Give back", "Zurückgeben", "Anna tagasi"],
  heading: ["Robot or map upright", "Roboter oder Karte aufrecht", "Robot või kaart püsti"],
  health: ["Health", "Zustand", "Seisund"],
  language: ["Language", "Sprache", "Keel"],
  late: ["Came too late: try again", "Kam zu spät: noch einmal", "Jõudis liiga hilja: proovi uuesti"],
  late_drive: ["Slow network: what the stick asks for comes too late",
    "Langsames Netz: was der Stick will, kommt zu spät", "Aeglane võrk: juhtkangi käsud jõuavad liiga hilja"],
  level_error: ["Error", "Fehler", "Viga"],
  level_ok: ["Well", "In Ordnung", "Korras"],
  level_warning: ["Warning", "Warnung", "Hoiatus"],
  light_battery: ["Battery", "Akku", "Aku"],
  "light_black box": ["Recording", "Aufzeichnung", "Salvestus"],
  light_board: ["Board", "Platine", "Juhtplaat"],
  "light_command stream": ["Commands", "Fahrbefehle", "Sõidukäsud"],
  light_gamepad: ["Gamepad", "Gamepad", "Mängupult"],
  light_guard: ["Obstacles", "Hindernisse", "Takistused"],
  light_gyro: ["Gyro", "Drehratensensor", "Güroskoop"],
  light_link: ["Link to the board", "Verbindung zur Platine", "Ühendus juhtplaadiga"],
  light_fleet: ["Class's page", "Seite der Klasse", "Klassi leht"],
  light_localization: ["Place on the map", "Ort auf der Karte", "Asukoht kaardil"],
  light_motion: ["Motion", "Bewegung", "Liikumine"],
  "light_real time": ["Simulator's speed", "Tempo der Simulation", "Simulaatori kiirus"],
  light_stamps: ["Clock", "Uhr", "Kell"],
  "light_web page": ["Web page", "Webseite", "Veebileht"],
  "light_wheel feedback": ["Wheels", "Räder", "Rattad"],
  "light_who drives": ["Who drives", "Wer fährt", "Kes juhib"],
  lost: ["No connection", "Keine Verbindung", "Ühendus puudub"],
  lost_advice: ["Is the robot on? Is this device in its Wi-Fi?",
    "Ist der Roboter an? Ist dieses Gerät in seinem WLAN?", "Kas robot töötab? Kas see seade on tema Wi-Fis?"],
  more: ["Show", "Zeigen", "Näita"],
  move: ["Drive; keys W, S, A, D", "Fahren; Tasten W, S, A, D", "Sõida; klahvid W, S, A, D"],
  no_reports: ["The robot reports nothing", "Der Roboter meldet nichts", "Robot ei teata midagi"],
  normal: ["Normal", "Normal", "Tavaline"],
  open: ["Open", "Öffnen", "Ava"],
  pages: ["Open pages", "Offene Seiten", "Avatud lehti"],
  release: ["Hold 1 s to release", "Zum Lösen 1 s halten", "Vabastamiseks hoia 1 s"],
  reset_odometry: ["Reset odometry", "Odometrie nullen", "Nulli odomeetria"],
  reset_what: ["Odometry restarts at 0, 0; in the simulator the robot keeps its place on the map",
    "Odometrie beginnt bei 0, 0; im Simulator bleibt der Ort auf der Karte",
    "Odomeetria algab nullist; simulaatoris jääb koht kaardil samaks"],
  round_trip: ["Round trip to the robot", "Hin und zurück zum Roboter", "Edasi-tagasi aeg robotini"],
  send: ["Drive there", "Dorthin fahren", "Sõida sinna"],
  slow: ["Slow", "Langsam", "Aeglane"],
  some_bad: ["Look here", "Hier nachsehen", "Vaata siia"],
  stop_label: ["Emergency stop; Space, Escape", "Not-Halt; Leertaste, Escape", "Hädaseiskamine; tühik, Escape"],
  stop_waits: ["STOP has NOT arrived", "STOP ist NICHT angekommen", "STOP EI jõudnud kohale"],
  stop_waits_why: ["It may still move: stay clear", "Er kann noch fahren: Abstand halten", "See võib veel liikuda: hoia eemale"],
  stopped: ["Emergency stop", "Not-Halt", "Hädaseiskamine"],
  swap: ["Camera or map", "Kamera oder Karte", "Kaamera või kaart"],
  take: ["Take over", "Übernehmen", "Võta üle"],
  taken: ["Another page has taken over", "Eine andere Seite hat übernommen", "Teine leht võttis juhtimise üle"],
  token_hint: ["Token: in the robot's terminal, or by", "Token: im Terminal des Roboters, oder mit",
    "Token: roboti terminalis, või käsuga"],
  token_later: ["Too many wrong tokens: wait a minute", "Zu viele falsche Token: eine Minute warten",
    "Liiga palju valesid tokeneid: oota minut"],
  token_show: ["Show what I type", "Eingabe zeigen", "Näita sisestatut"],
  token_wrong: ["Wrong token", "Falsches Token", "Vale token"],
  turn: ["Turn; keys Q, E", "Drehen; Tasten Q, E", "Pööra; klahvid Q, E"],
  view: ["The robot from above", "Der Roboter von oben", "Robot pealtvaates"],
  wheels: ["Wheels: commanded and measured", "Räder: Soll und Ist", "Rattad: käsk ja mõõdetud"],
  whole: ["The whole map", "Die ganze Karte", "Kogu kaart"],
  who_gamepad: ["A gamepad drives", "Ein Gamepad fährt", "Juhib mängupult"],
  who_hand: ["By hand:", "Von Hand:", "Käsitsi:"],
  who_keys: ["Keys drive", "Tasten fahren", "Juhivad klahvid"],
  who_navigation: ["Navigation drives", "Navigation fährt", "Juhib navigatsioon"],
  who_nobody: ["Nobody drives", "Niemand fährt", "Keegi ei juhi"],
  who_other: ["Another page drives", "Eine andere Seite fährt", "Juhib teine leht"],
  who_others: ["Another page has it", "Eine andere Seite hat ihn", "Teise lehe käes"],
  who_program: ["Program:", "Programm:", "Programm:"],
  who_you: ["You drive", "Du fährst", "Sina juhid"],
  who_yours: ["Yours: it stands", "Du hast ihn: er steht", "Sinu käes: seisab"],
};

let language = 0;

export function chosenLanguage() {
  let saved = null;
  try {
    saved = localStorage.getItem("language");
  } catch { /* no storage: the browser's language */ }
  const wishes = [saved, ...navigator.languages].filter(Boolean).map((wish) => wish.slice(0, 2));
  return wishes.find((wish) => LANGUAGES[wish]) || "en";
}

export function setLanguage(code) {
  language = Object.keys(LANGUAGES).indexOf(code);
  document.documentElement.lang = code;
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

// The list of languages: shows the page in the one that is chosen, and then calls changed().
export function languageList(list, changed) {
  list.replaceChildren(...Object.entries(LANGUAGES).map(([code, name]) => new Option(name, code)));
  const speak = (code) => {
    list.value = code;
    setLanguage(code);
    changed();
  };
  list.addEventListener("change", () => {
    speak(list.value);
    try {
      localStorage.setItem("language", list.value);
    } catch { /* no storage: asked anew next time */ }
  });
  speak(chosenLanguage());
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
