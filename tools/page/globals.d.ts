// What the page's scripts define for each other.
declare const uPlot: any;
