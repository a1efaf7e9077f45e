// The page's words in three languages, out of the files that <html data-texts> names: {key: {en, de, et}}.
const texts = {language: {en: "English"}};
const wishes = [document.cookie.match(/language=(\w+)/)?.[1], ...navigator.languages];
let codes = ["en"], language = "en", spoken = () => {};

async function load(file) {
  try {
    Object.assign(texts, await (await fetch(file, {signal: AbortSignal.timeout(3000)})).json());
  } catch {
    setTimeout(() => load(file), 1000);
    return;
  }
  codes = Object.keys(texts.language);
  language = wishes.map((wish) => wish?.slice(0, 2)).find((wish) => codes.includes(wish)) ?? "en";
  speak();
  spoken();
}

// The words of a key, each {} filled in; "" for a key that has none
export const text = (key, ...values) =>
  values.reduce((words, value) => words.replace("{}", () => value), texts[key]?.[language] ?? "");

// Puts the words into all elements that name their keys.
export function speak(page = document) {
  document.documentElement.lang = language;
  for (const element of page.querySelectorAll("[data-text]")) {
    element.textContent = text(element.dataset.text);
  }
  for (const element of page.querySelectorAll("[data-label]")) {
    element.ariaLabel = text(element.dataset.label);
    element.title = element.matches("button, .fact") ? element.ariaLabel : "";
  }
}

// A button that shows the page in the next language, whose name it has; changed(): there are other words.
export function languageButton(button, changed) {
  const next = () => codes[(codes.indexOf(language) + 1) % codes.length];
  spoken = () => {
    button.textContent = texts.language[button.lang = next()];
    changed();
  };
  button.addEventListener("click", () => {
    wishes.unshift(language = next());
    document.cookie = `language=${language}; max-age=31536000; SameSite=Strict`;
    speak();
    spoken();
  });
  spoken();
}

// The page waits for its words, but not long: STOP needs none.
const loading = document.documentElement.dataset.texts.split(" ").map(load);
await Promise.race([Promise.all(loading), new Promise((late) => setTimeout(late, 1000))]);
