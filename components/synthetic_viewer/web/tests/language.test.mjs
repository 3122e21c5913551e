// The page's language: which one, what is filled in, and that all that stands on the page changes with it.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Page, texts} from './browser.mjs';

const page = options => new Page(['language.js'], options);

test("the language chosen before prevails, then the browser's first that there is, then English", () => {
  for (const [languages, kept, expected] of [
    [['de-DE', 'de'], {}, 'de'],
    [['fr', 'de-AT', 'en'], {}, 'de'],
    [['fr', 'it'], {}, 'en'],
    [['en-US'], {'phantom-language': 'de'}, 'de'],
    [['de'], {'phantom-language': 'en'}, 'en'],
    [['de'], {'phantom-language': 'xx'}, 'de'],
  ])
    assert.equal(page({languages, kept}).document.documentElement.lang, expected, JSON.stringify([languages, kept]));
});

test('another language is written everywhere at once and remembered', () => {
  const en = texts('en'),
    de = texts('de'),
    shown = page();
  let told = 0;
  shown.window.addEventListener('language', () => ++told);
  const stop = shown.byId('stop'),
    banner = shown.document.querySelector('[data-text="stop.button"]');
  assert.equal(banner.textContent, en['stop.button']);
  shown.document.querySelector('#languages [lang=de]').click();
  assert.equal(told, 1);
  assert.equal(banner.textContent, de['stop.button']);
  assert.equal(stop.title, de['stop.title']);
  assert.equal(shown.byId('main-view').alt, de['view.main_alt']);
  assert.equal(shown.byId('languages').getAttribute('aria-label'), de['page.language']);
  assert.equal(shown.document.documentElement.lang, 'de');
  assert.equal(shown.window.localStorage.getItem('phantom-language'), 'de');
  for (const element of shown.document.querySelectorAll('[data-text]'))
    assert.equal(element.textContent, de[element.dataset.text]);
  for (const button of shown.document.querySelectorAll('#languages button'))
    assert.equal(button.getAttribute('aria-pressed'), String(button.lang === 'de'));
});

test('a browser that keeps nothing still speaks the language that is chosen', () => {
  const shown = page();
  shown.window.localStorage.setItem = () => {
    throw new Error('nothing may be kept');
  };
  shown.run('speak("de")');
  assert.equal(shown.document.documentElement.lang, 'de');
});

test('values are filled in with so many decimals, as the language writes them', () => {
  const shown = page();
  shown.run('kTexts.en["t"] = "{a} {b:.2f} {c:.0f} {a}"; kTexts.de["t"] = "{b:.2f}"');
  const filled = values => shown.run(`text('t', ${JSON.stringify(values)})`);
  assert.equal(filled({a: 'x', b: 0.467, c: 2.5}), 'x 0.47 3 x');
  assert.equal(filled({a: 'x', b: -0.001, c: 12345.6}), 'x 0.00 12346 x', 'no minus before a nought, no grouping');
  assert.equal(filled({a: 7, b: 'unknown', c: null}), '7 unknown null 7', 'what is no number is written as it comes');
  shown.run('speak("de")');
  assert.equal(filled({b: 0.467}), '0,47');
});

test('a value may be a text of its own, and is no pattern', () => {
  const shown = page();
  shown.run('Object.assign(kTexts.en, { outer: "[{inner}]", inner: "<{name}>" })');
  assert.equal(shown.run('text("outer", { inner: { key: "inner", values: { name: "pump" } } })'), '[<pump>]');
  assert.equal(shown.run('text("outer", { inner: "{inner} $& {x:.1f}" })'), '[{inner} $& {x:.1f}]');
  assert.equal(shown.run('text("no.such.text")'), 'no.such.text');
  assert.equal(shown.run('said({ key: "inner", values: { name: "a" } }, "English")'), '<a>');
  assert.equal(shown.run('said(null, "English")'), 'English');
});
