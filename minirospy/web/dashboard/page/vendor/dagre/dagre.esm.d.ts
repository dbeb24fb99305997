// Types for tools/check_page.py.
export const Graph: any;
export const layout: any;
