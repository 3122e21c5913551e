// node format.mjs FOLDER [--check], started by scripts/format from the tree's root, with paths on standard input, one a line. FOLDER
// has the packages that package-lock.json pins. JavaScript is laid out by prettier. Python is judged by ruff, which names
// each place and changes nothing. --check writes nothing. Ends with 1 if a file is laid out otherwise or a place is named.
import {readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';

const [folder, mode] = process.argv.slice(2);
const require = createRequire(path.resolve(folder, 'package.json'));
const prettier = require('prettier');
const ruff = require('@astral-sh/ruff-wasm-nodejs');

const LAYOUT = {
  parser: 'babel',
  printWidth: 120,
  singleQuote: true,
  bracketSpacing: false,
  arrowParens: 'avoid',
  objectWrap: 'collapse',
};
// Pycodestyle, pyflakes and bugbear. Not: zip() without strict= (B905), a loop's variable in a lambda that is used in
// the same turn (B023), and the length of a line (E501), which breaks tables of expected text.
const RULES = {
  'line-length': 120,
  'target-version': 'py311',
  lint: {select: ['E', 'W', 'F', 'B'], ignore: ['B905', 'B023', 'E501']},
};

const linter = new ruff.Workspace(RULES, ruff.PositionEncoding.Utf16);
let failed = false;
for (const file of readFileSync(0, 'utf8').split('\n').filter(Boolean)) {
  const text = readFileSync(file, 'utf8');
  if (file.endsWith('.js') || file.endsWith('.mjs')) {
    const laidOut = await prettier.format(text, {...LAYOUT, filepath: file});
    if (laidOut === text) continue;
    if (mode === '--check') {
      console.error(`${file}: laid out otherwise; run scripts/format`);
      failed = true;
    } else {
      writeFileSync(file, laidOut);
    }
  } else {
    for (const place of linter.check(text)) {
      console.error(`${file}:${place.start_location.row}: ${place.code} ${place.message}`);
      failed = true;
    }
  }
}
process.exit(failed ? 1 : 0);
