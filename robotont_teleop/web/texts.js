// Every text of the page: English, German, Estonian. Faults by their key, of hand/fault_keys.py.
export const LANGUAGES = ["en", "de", "et"];
export const TEXTS = {
  all_well: ["All is well", "Alles in Ordnung", "Kõik on korras"],
  battery: ["Battery", "Akku", "Aku"],
  board: ["Board", "Platine", "Juhtplaat"],
  camera: ["Camera", "Kamera", "Kaamera"],
  can_drive: ["Push a stick to drive", "Zum Fahren Stick bewegen", "Sõitmiseks lükka kangi"],
  can_let_go: ["Let go of the sticks once", "Sticks einmal loslassen", "Lase korraks lahti"],
  can_mix: ["Careful: it mixes with a program", "Vorsicht: mischt sich mit Programm", "Ettevaatust: seguneb programmiga"],
  can_no_board: ["No board: sticks are off", "Keine Platine: Sticks aus", "Plaati pole: juhtkangid väljas"],
  can_no_mux: ["No cmd_vel_mux: sticks are off", "Kein cmd_vel_mux: Sticks aus", "cmd_vel_mux puudub: juhtkangid väljas"],
  can_nothing: ["Sticks are off", "Sticks aus", "Juhtkangid väljas"],
  can_release: ["Sticks wait for the release", "Sticks warten auf das Lösen", "Juhtkangid ootavad"],
  can_stop: ["Let go to stop", "Zum Anhalten loslassen", "Peatumiseks lase lahti"],
  can_take_it: ["A stick takes it over", "Ein Stick übernimmt", "Juhtkang võtab üle"],
  can_take_over: ["Take over first", "Erst übernehmen", "Võta enne üle"],
  can_wait: ["The connection stalls", "Die Verbindung stockt", "Ühendus takerdub"],
  cancel: ["Cancel the goal", "Ziel abbrechen", "Tühista sihtkoht"],
  caption_move: ["Drive", "Fahren", "Sõida"],
  caption_stop: ["Space", "Leertaste", "Tühik"],
  caption_turn: ["Turn", "Drehen", "Pööra"],
  chips: ["Speed; keys 1, 2, 3", "Tempo; Tasten 1, 2, 3", "Kiirus; klahvid 1, 2, 3"],
  closer: ["Closer", "Näher", "Lähemale"],
  details: ["Details", "Einzelheiten", "Üksikasjad"],
  farther: ["Farther", "Weiter weg", "Kaugemale"],
  fast: ["Fast", "Schnell", "Kiire"],
  fault_barred: ["It waits until all have stopped once: let go of the stick, or end the program",
    "Er wartet, bis alle einmal angehalten haben: Stick loslassen oder Programm beenden",
    "Ootab, kuni kõik on korra peatunud: lase juhtkang lahti või lõpeta programm"],
  fault_battery_low: ["The battery is nearly empty: charge it", "Der Akku ist fast leer: laden",
    "Aku on peaaegu tühi: lae"],
  fault_board_fault: ["The board reports a fault of a motor: look at motors and cables",
    "Die Platine meldet einen Motorfehler: Motoren und Kabel ansehen",
    "Juhtplaat teatab mootori veast: vaata mootoreid ja kaableid"],
  fault_board_silent: ["The board says nothing: is it switched on?", "Die Platine schweigt: Ist sie eingeschaltet?",
    "Juhtplaat vaikib: kas see on sisse lülitatud?"],
  fault_board_unknown: ["The board speaks otherwise: is it this robot's?",
    "Die Platine spricht anders: Gehört sie zu diesem Roboter?",
    "Juhtplaat räägib teisiti: kas see on selle roboti oma?"],
  fault_clock_set: ["The clock was set", "Die Uhr wurde verstellt", "Kella on muudetud"],
  fault_guard_blind: ["It does not see everywhere: drive with care", "Er sieht nicht überall: vorsichtig fahren",
    "See ei näe kõikjale: sõida ettevaatlikult"],
  fault_gyro_unused: ["The gyro is not used", "Der Drehratensensor wird nicht verwendet", "Güroskoopi ei kasutata"],
  fault_in_the_way: ["Something is in the way", "Etwas ist im Weg", "Midagi on ees"],
  fault_line_noisy: ["The cable to the board loses data: look at it", "Das Kabel zur Platine verliert Daten: nachsehen",
    "Juhtplaadi kaabel kaotab andmeid: vaata üle"],
  fault_lost: ["It is not sure where it is: show it its place", "Er weiß nicht sicher, wo er ist: Ort zeigen",
    "See ei tea kindlalt, kus ta on: näita kohta"],
  fault_no_map: ["There is no map", "Es gibt keine Karte", "Kaarti pole"],
  fault_no_scan: ["The scanner is silent: does it run?", "Der Scanner schweigt: Läuft er?",
    "Skanner vaikib: kas see töötab?"],
  fault_other_publisher: ["A program drives past the choice of drivers: let it use cmd_vel/default",
    "Ein Programm umgeht die Auswahl: Es soll cmd_vel/default nehmen",
    "Programm läheb valikust mööda: kasutagu see cmd_vel/default"],
  fault_other_sender: ["Two want to drive at once: the first one does", "Zwei wollen zugleich fahren: Der erste fährt",
    "Kaks tahavad korraga juhtida: juhib esimene"],
  fault_pad_gone: ["The gamepad is still, or out of reach: move a stick",
    "Das Gamepad ist still oder außer Reichweite: einen Stick bewegen",
    "Mängupult on paigal või levist väljas: liiguta juhtkangi"],
  fault_pad_missing: ["There is no gamepad: plug it in", "Es gibt kein Gamepad: einstecken",
    "Mängupulti pole: ühenda see"],
  fault_page_let_go: ["The page that drives fell silent: let go once", "Die fahrende Seite schwieg: einmal loslassen",
    "Juhtiv leht vaikis: lase korraks lahti"],
  fault_port_forbidden: ["This user may not use the board: group dialout",
    "Dieser Benutzer darf nicht an die Platine: Gruppe dialout",
    "Sellel kasutajal pole juhtplaadile õigust: grupp dialout"],
  fault_port_missing: ["The board's cable is out, or the board is off",
    "Das Kabel der Platine steckt nicht, oder sie ist aus", "Juhtplaadi kaabel on lahti või plaat on väljas"],
  fault_port_taken: ["Another program has the board: end it", "Ein anderes Programm hat die Platine: beenden",
    "Juhtplaat on teise programmi käes: lõpeta see"],
  fault_program_fault: ["A fault of the program: please report it", "Ein Fehler des Programms: bitte melden",
    "Programmi viga: palun teata sellest"],
  fault_recording_lost: ["The recording loses data: is the disk full?",
    "Die Aufzeichnung verliert Daten: Ist die Platte voll?", "Salvestus kaotab andmeid: kas ketas on täis?"],
  fault_refused: ["A command was refused: a program sends nonsense",
    "Ein Fahrbefehl wurde abgelehnt: Ein Programm sendet Unsinn", "Sõidukäsk lükati tagasi: programm saadab jama"],
  fault_silent: ["Has said nothing for 5 s: has it ended?", "Meldet sich seit 5 s nicht: Ist es beendet?",
    "Vaikib juba 5 s: kas see on lõppenud?"],
  fault_slow_computer: ["The simulation is too slow for this computer",
    "Die Simulation ist zu langsam für diesen Rechner", "Simulatsioon on selle arvuti jaoks liiga aeglane"],
  fault_wheel_blocked: ["A wheel does not turn as told: is it blocked?",
    "Ein Rad dreht nicht wie befohlen: Ist es blockiert?", "Ratas ei pöörle käsu järgi: kas see on kinni?"],
  fault_wheel_slips: ["A wheel slips: its place is less certain", "Ein Rad rutscht: Der Ort ist weniger sicher",
    "Ratas libiseb: asukoht on vähem kindel"],
  fault_wheels_silent: ["The wheels report nothing: see the board", "Die Räder melden nichts: siehe Platine",
    "Rattad ei anna märku: vaata juhtplaati"],
  give_back: ["Give back", "Zurückgeben", "Anna tagasi"],
  heading: ["Robot or map upright", "Roboter oder Karte aufrecht", "Robot või kaart püsti"],
  health: ["Health", "Zustand", "Seisund"],
  language: ["Language", "Sprache", "Keel"],
  late: ["Came too late: try again", "Kam zu spät: noch einmal", "Jõudis liiga hilja: proovi uuesti"],
  late_drive: ["Slow network: what the stick asks for comes too late", "Langsames Netz: was der Stick will, kommt zu spät",
    "Aeglane võrk: juhtkangi käsud jõuavad liiga hilja"],
  level_error: ["Error", "Fehler", "Viga"],
  level_ok: ["Well", "In Ordnung", "Korras"],
  level_silent: ["Silent for 5 s: has it ended?", "Seit 5 s still: Ist es beendet?", "5 s vait: kas see on lõppenud?"],
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
  lost_advice: ["No connection: does the robot run, and is this device in its network?",
    "Keine Verbindung: Läuft der Roboter, und ist dieses Gerät in seinem Netz?",
    "Ühendus puudub: kas robot töötab ja kas see seade on tema võrgus?"],
  more: ["Show", "Zeigen", "Näita"],
  move: ["Drive: ahead, back, left, right; keys W, S, A, D", "Fahren: vor, zurück, links, rechts; Tasten W, S, A, D",
    "Sõida: edasi, tagasi, vasakule, paremale; klahvid W, S, A, D"],
  no_reports: ["The robot reports nothing", "Der Roboter meldet nichts", "Robot ei teata midagi"],
  normal: ["Normal", "Normal", "Tavaline"],
  open: ["Open", "Öffnen", "Ava"],
  pages: ["Open pages", "Offene Seiten", "Avatud lehti"],
  release: ["Hold 1 s to release", "Zum Lösen 1 s halten", "Vabastamiseks hoia 1 s"],
  reset_odometry: ["Reset odometry", "Odometrie nullen", "Nulli odomeetria"],
  reset_what: ["The robot's place becomes 0, 0; the map stays where it is",
    "Der Ort des Roboters wird 0, 0; die Karte bleibt, wo sie ist", "Roboti asukoht saab 0, 0; kaart jääb paigale"],
  round_trip: ["Round trip to the robot", "Hin und zurück zum Roboter", "Edasi-tagasi aeg robotini"],
  send: ["Drive there", "Dorthin fahren", "Sõida sinna"],
  slow: ["Slow", "Langsam", "Aeglane"],
  some_bad: ["Look here", "Hier nachsehen", "Vaata siia"],
  stop_label: ["Emergency stop; key Space or Escape", "Not-Halt; Leertaste oder Escape",
    "Hädaseiskamine; tühik või Escape"],
  stop_waits: ["STOP has NOT reached the robot", "STOP ist NICHT beim Roboter angekommen",
    "STOP EI OLE robotini jõudnud"],
  stop_waits_why: ["Stay clear; it goes out again by itself", "Abstand halten; es wird von selbst wiederholt",
    "Hoia eemale; seda korratakse ise"],
  stopped: ["Emergency stop", "Not-Halt", "Hädaseiskamine"],
  swap: ["Camera or map", "Kamera oder Karte", "Kaamera või kaart"],
  take: ["Take over", "Übernehmen", "Võta üle"],
  taken: ["Another page has taken over", "Eine andere Seite hat übernommen", "Teine leht võttis juhtimise üle"],
  token_hint: [
    "Token (in the terminal that serves this page; robot started at boot: sudo cat /var/lib/robotont/robotont_teleop_token)",
    "Token (steht im Terminal, das diese Seite liefert; startet der Roboter von selbst: sudo cat /var/lib/robotont/robotont_teleop_token)",
    "Token (terminalis, kust see leht tuleb; kui robot käivitub ise: sudo cat /var/lib/robotont/robotont_teleop_token)"],
  token_later: ["Too many wrong tokens: wait a minute", "Zu viele falsche Token: eine Minute warten",
    "Liiga palju valesid tokeneid: oota minut"],
  token_show: ["Show what I type", "Eingabe zeigen", "Näita sisestatut"],
  token_wrong: ["Wrong token", "Falsches Token", "Vale token"],
  turn: ["Turn left or right; keys Q, E", "Links oder rechts drehen; Tasten Q, E",
    "Pööra vasakule või paremale; klahvid Q, E"],
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
  who_yours: ["You drive: it stands", "Du fährst: er steht", "Sina juhid: seisab"],
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
