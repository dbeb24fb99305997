// The German texts of the page, by the English ones.

export const GERMAN = {
};
