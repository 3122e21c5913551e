// What the drawn scene says, in the page's language: from the page's texts (language.js).
export const say = (key, values = {}) => window.text(key, values);
