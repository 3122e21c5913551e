// Draws the scene in the browser; without it, the page shows the server's pictures.

import {Desk} from './desk.js';

window.phantomScene = new Desk(window.operatorPage);
window.phantomScene.start();
