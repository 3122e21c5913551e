'use strict';
// The texts of the page, in the language of the browser or the one chosen here. index.html brings them (texts.*.json): elements
// name theirs by data-text, data-title, data-label (aria-label) and data-alt; scripts by text(); the viewer by key and values.

const kTexts = JSON.parse(document.getElementById('texts').textContent);
const kLocales = {en: 'en-GB', de: 'de-DE'};
const kLanguageKept = 'phantom-language';
const kTextPlaces = {
  text: (e, t) => {
    e.textContent = t;
  },
  title: (e, t) => {
    e.title = t;
  },
  label: (e, t) => e.setAttribute('aria-label', t),
  alt: (e, t) => {
    e.alt = t;
  },
};

function wantedLanguage() {
  let kept = null;
  try {
    kept = localStorage.getItem(kLanguageKept);
  } catch (problem) {
    /* this browser keeps nothing */
  }
  return (
    [kept, ...navigator.languages].map(name => String(name).slice(0, 2).toLowerCase()).find(name => name in kTexts) ??
    'en'
  );
}
let language = wantedLanguage();

const kFormats = {}; // by language and digits: to make one takes a hundred times as long as to use it
function number(value, digits) {
  kFormats[language + digits] ??= new Intl.NumberFormat(kLocales[language], {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
    useGrouping: false,
    signDisplay: 'negative',
  });
  return kFormats[language + digits].format(value);
}

// Returns the text of that key in the page's language. {name} is replaced by the value of that name, {name:.1f} by a number
// with so many decimals; a value may be a text with values of its own, as the viewer sends it: { key, values }.
function text(key, values = {}) {
  return (kTexts[language][key] ?? key).replace(/\{(\w+)(?::\.(\d)f)?\}/g, (whole, name, digits) => {
    const value = values[name];
    return typeof value === 'object' && value !== null
      ? text(value.key, value.values)
      : digits !== undefined && typeof value === 'number'
        ? number(value, +digits)
        : String(value);
  });
}

// Returns what the viewer says, in the page's language; its English sentence if it has no key.
function said(words, english = '') {
  return words ? text(words.key, words.values) : english;
}

function showTexts() {
  document.documentElement.lang = language;
  for (const [place, set] of Object.entries(kTextPlaces))
    for (const element of document.querySelectorAll(`[data-${place}]`)) set(element, text(element.dataset[place]));
  for (const button of document.querySelectorAll('#languages button'))
    button.setAttribute('aria-pressed', button.lang === language);
  dispatchEvent(new Event('language'));
}

function speak(chosen) {
  language = chosen;
  try {
    localStorage.setItem(kLanguageKept, chosen);
  } catch (problem) {
    /* chosen for this visit */
  }
  showTexts();
}

for (const name of Object.keys(kTexts)) {
  const button = Object.assign(document.createElement('button'), {
    type: 'button',
    lang: name,
    textContent: name.toUpperCase(),
    title: kTexts[name]['page.language_name'],
  });
  button.setAttribute('aria-label', `${button.textContent}: ${kTexts[name]['page.language_name']}`);
  button.addEventListener('click', () => speak(name));
  document.getElementById('languages').append(button);
}
showTexts();
