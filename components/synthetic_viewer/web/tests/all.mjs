// node all.mjs FILE…: runs these files of tests in one process, which starts once. `node --test FOLDER` runs each in its own.
import {pathToFileURL} from 'node:url';

for (const file of process.argv.slice(2)) await import(pathToFileURL(file));
