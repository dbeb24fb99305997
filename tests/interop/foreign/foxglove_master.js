// The master of @foxglove/ros1, on a free port. Prints its URI; ends with its input.
"use strict";

const path = require("path");
// It is not among what the package exports.
const { RosMaster } = require(path.join(path.dirname(require.resolve("@foxglove/ros1")), "RosMaster.js"));
const { HttpServerNodejs } = require("@foxglove/xmlrpc/nodejs");

const master = new RosMaster(new HttpServerNodejs());
master.start("localhost").then(() => process.stdout.write(master.url() + "\n"));
process.stdin.on("end", () => process.exit(0));
process.stdin.resume();
