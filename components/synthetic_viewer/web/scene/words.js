// What the drawn scene says, in the page's language: from the page's texts (language.js), or by the viewer's words.
export const say = (key, values = {}) => window.text(key, values);
export const said = words => window.said(words);
