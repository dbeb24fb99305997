// The German texts of the page, by the English ones.

export const GERMAN = {
  // the shell
  "Views": "Ansichten", "Keys": "Tasten", "Dark or light": "Dunkel oder hell", "To the view": "Zur Ansicht", "Close": "Schließen", "Dismiss": "Ausblenden",
  "connecting …": "verbindet …", "connected": "verbunden", "connection lost, trying again …": "Verbindung verloren, neuer Versuch …",
  "no connection, trying again …": "keine Verbindung, neuer Versuch …", ", read-only": ", nur lesen",
  "This list": "Diese Liste", "The view before and after this one": "Die Ansicht davor und danach", "To the filter of the view": "Zum Filter der Ansicht",
  "To the next button or field, and press it": "Zum nächsten Knopf oder Feld, und drücken", "Teleop: drive while they are held": "Fahren: solange sie gehalten werden",
  "Board: press its buttons while they are held": "Board: seine Taster drücken, solange sie gehalten werden",
  "Layouts: move a pane (its dots) or a divider; Board: move the person": "Anordnungen: einen Bereich (an seinen Punkten) oder eine Trennlinie verschieben; Board: die Person bewegen",
  "Close what is open": "Schließen, was offen ist",
  // names of views
  "Layouts": "Anordnungen", "Topics": "Topics", "Console": "Konsole", "Plot": "Kurven", "Graph": "Graph", "Image": "Bild", "Board": "Board", "Turtlesim": "Turtlesim",
  "Teleop": "Fahren", "Diagnostics": "Diagnose", "Panels": "Anzeigen", "Publish": "Senden", "Services": "Services", "Parameters": "Parameter", "Reconfigure": "Einstellen", "3D": "3D",
  "Frames": "Koordinatensysteme", "Actions": "Actions", "Nodes": "Nodes", "Launch": "Launch", "Bags": "Bags", "Joints": "Gelenke", "State machines": "Zustandsautomaten",
  // words of several views
  "Topic": "Topic", "Node": "Node", "Service": "Service", "Filter": "Filter", "Search": "Suchen", "Clear": "Leeren", "Copy": "Kopieren", "Pause": "Anhalten", "Continue": "Weiter", "PNG": "PNG", "CSV": "CSV",
  "Stop": "Stopp", "Save": "Speichern", "Delete": "Löschen", "Label": "Beschriftung", "Name": "Name", "on": "an", "off": "aus", "type": "Typ", "done": "fertig",
  "green": "grün", "yellow": "gelb", "red": "rot", "blue": "blau", "node": "Node", "topic": "Topic", "choose a topic": "Topic wählen",
  "This token is read-only.": "Dieses Token darf nur lesen.", "waiting for {path}": "wartet auf {path}", "Reset": "Zurücksetzen",
  // layouts
  "Layout": "Anordnung", "Layouts …": "Anordnungen …", "Presets": "Vorlagen", "Saved in this browser": "In diesem Browser gespeichert", "Add a view": "Ansicht hinzufügen", "Add a view …": "Ansicht hinzufügen …",
  "Name of the layout": "Name der Anordnung", "Copy link": "Link kopieren", "Export": "Exportieren", "Import": "Importieren", "Link of the layout": "Link der Anordnung",
  "There is no preset {name}.": "Es gibt keine Vorlage {name}.", "Looking for boards and robots …": "Sucht Boards und Roboter …", "{count} views": "{count} Ansichten",
  "A layout has {count} views at most.": "Eine Anordnung hat höchstens {count} Ansichten.", "Type a name first.": "Zuerst einen Namen eingeben.", "Saved in this browser.": "In diesem Browser gespeichert.",
  "{name} is deleted.": "{name} ist gelöscht.", "The link is copied.": "Der Link ist kopiert.", "Copy it from here:": "Von hier kopieren:", "it is too large": "sie ist zu groß",
  "it is not a layout of this page": "sie ist keine Anordnung dieser Seite", "View of this pane": "Ansicht dieses Bereichs", "Move this pane: arrow keys, or drag": "Bereich verschieben: Pfeiltasten oder ziehen",
  "Drag to move": "Zum Verschieben ziehen", "Maximise": "Maximieren", "Split: another view to the right": "Teilen: eine Ansicht rechts daneben", "Split: another view below": "Teilen: eine Ansicht darunter",
  "Close this pane": "Bereich schließen", "Divider: arrow keys, or drag": "Trennlinie: Pfeiltasten oder ziehen", "This page has no such view.": "Diese Seite hat keine solche Ansicht.",
  "Workshop": "Workshop", "the board, its button in a plot, the log lines, the graph": "das Board, sein Taster als Kurve, die Meldungen, der Graph",
  "log lines, topics, diagnostics and parameters": "Meldungen, Topics, Diagnose und Parameter", "a stick, the camera, and a plot of the speeds": "ein Steuerknüppel, die Kamera und die Geschwindigkeiten als Kurven",
  "Classroom": "Klassenzimmer", "the boards and robots of a group side by side": "die Boards und Roboter einer Gruppe nebeneinander",
  // topics
  "Filter topics and types": "Topics und Typen filtern", "{count} of {all} topics": "{count} von {all} Topics", "No topic fits the filter.": "Kein Topic passt zum Filter.",
  "Nothing is published yet. Start a node: its topics appear here.": "Noch wird nichts gesendet. Einen Node starten: seine Topics erscheinen hier.", "open to measure": "zum Messen öffnen",
  "Waiting for a message …": "Wartet auf eine Nachricht …", "Plot {path}": "{path} als Kurve", "plot": "Kurve", "{count} values": "{count} Werte", ", the first {count} are shown": ", die ersten {count} sind gezeigt",
  // console
  "Debug": "Debug", "Info": "Info", "Warn": "Warnung", "Error": "Fehler", "Fatal": "Fatal", "all nodes": "alle Nodes", "Search messages and nodes": "Meldungen und Nodes durchsuchen", "↓ Latest": "↓ Neueste",
  "Logger levels": "Log-Stufen", "Log lines": "Meldungen", "Export CSV": "CSV exportieren", "{count} of {all} lines": "{count} von {all} Zeilen", ", paused, {waiting} new": ", angehalten, {waiting} neue",
  "Only this node": "Nur dieser Node", "Copied {count}": "{count} kopiert", "The browser refuses": "Der Browser erlaubt es nicht", "Node of the loggers": "Node der Logger", "choose a node": "Node wählen",
  "what a node logs, from this level on": "was ein Node meldet, ab dieser Stufe", "regex": "regulärer Ausdruck", "exclude": "ausschließen",
  // plot
  "What to plot": "Was gezeichnet wird", "Time shown": "Gezeigte Zeit", "5 s": "5 s", "10 s": "10 s", "30 s": "30 s", "1 min": "1 min", "5 min": "5 min", "Follow": "Folgen",
  "Type a path above, or choose “plot” next to a field in Topics.": "Oben einen Pfad eingeben, oder in Topics neben einem Feld „Kurve“ wählen.", "Series": "Kurven", "Show or hide": "Zeigen oder verbergen",
  "drag: zoom · wheel: zoom · shift and wheel: pan · double click: follow": "ziehen: zoomen · Rad: zoomen · Umschalt und Rad: schieben · Doppelklick: folgen",
  "Move to the other axis": "Auf die andere Achse", "left axis": "linke Achse", "right axis": "rechte Achse",
  "/topic/field, /topic/array[0:5]": "/topic/feld, /topic/array[0:5]",
  // graph
  "Nodes and topics (active)": "Nodes und Topics (aktive)", "Nodes and topics (all)": "Nodes und Topics (alle)", "Nodes only": "Nur Nodes", "What is shown": "Was gezeigt wird", "Filter names": "Namen filtern",
  "Graph of nodes and topics": "Graph der Nodes und Topics", "hide debug": "Debug verbergen", "Fit": "Einpassen", "No nodes yet. Start one: it appears here.": "Noch kein Node. Einen starten: er erscheint hier.",
  "Publishes": "Sendet", "Subscribes to": "Empfängt", "its type is not known yet": "sein Typ ist noch nicht bekannt", "live values": "Werte live", "Publishers": "Sender", "Subscribers": "Empfänger",
  "Nobody publishes this topic.": "Niemand sendet dieses Topic.",
  // image
  "actual size": "Originalgröße", "no topic has images": "kein Topic hat Bilder", "Waiting for {topic} …": "Wartet auf {topic} …", "Start a camera, or play a bag with images.": "Eine Kamera starten, oder ein Bag mit Bildern abspielen.",
  "a compressed image of format \"{format}\" cannot be shown by this browser": "dieser Browser kann ein komprimiertes Bild im Format „{format}“ nicht zeigen",
  // board
  "The board": "Das Board", "The scanner's fields and a person": "Die Felder des Scanners und eine Person",
  "Hold a button with the mouse or a finger, or the keys 1 and 2.": "Einen Taster mit Maus oder Finger halten, oder die Tasten 1 und 2.", "Other pins:": "Andere Pins:", "Button GPIO {pin}": "Taster GPIO {pin}",
  "warning field": "Warnfeld", "protective field": "Schutzfeld", "Send the person away": "Person wegschicken", "Let a person come": "Person kommen lassen",
  "{ahead} m ahead, {left} m to the left": "{ahead} m voraus, {left} m links", ": in the protective field": ": im Schutzfeld", ": in the warning field": ": im Warnfeld", "nobody before the scanner": "niemand vor dem Scanner", "The person: drag, or the arrow keys": "Die Person: ziehen, oder die Pfeiltasten",
  // turtlesim
  "The turtles' paper": "Das Papier der Schildkröten", "Simulator": "Simulator", "Spawn": "Erzeugen", "New turtle": "Neue Schildkröte", "A click on the paper sets x and y.": "Ein Klick auf das Papier setzt x und y.",
  "There is no turtle: start rosrun turtlesim turtlesim_node": "Es gibt keine Schildkröte: rosrun turtlesim turtlesim_node starten", "The color under the turtle": "Die Farbe unter der Schildkröte",
  "pen of {name}": "Stift von {name}", "width of the pen of {name}": "Breite des Stifts von {name}", "set pen": "Stift setzen", "drive": "fahren", "kill": "entfernen", "name": "Name",
  // teleop
  "Metres a second": "Meter pro Sekunde", "Radians a second": "Radiant pro Sekunde", "Stick: up is forward": "Steuerknüppel: oben ist vorwärts", "stopped": "steht",
  "Hold the stick, or the arrow keys or W A S D. With a gamepad hold a shoulder button and push its left stick.":
    "Den Knüppel halten, oder die Pfeiltasten oder W A S D. Beim Gamepad eine Schultertaste halten und den linken Stick bewegen.",
  "publish the gamepad as /joy": "das Gamepad als /joy senden", "This token is read-only: it drives nothing.": "Dieses Token darf nur lesen: es fährt nichts.",
  "{topic} has the type {type}, not {wanted}": "{topic} hat den Typ {type}, nicht {wanted}", "Gamepad:": "Gamepad:", "stopped by the server: this page was silent": "vom Server angehalten: diese Seite schwieg",
  // diagnostics
  "OK": "OK", "Warning": "Warnung", "Stale": "Veraltet", "only problems": "nur Probleme", "the aggregated ones, else all": "die zusammengefassten, sonst alle", "Nothing reports a problem.": "Nichts meldet ein Problem.",
  "Nothing has come on {topic}.": "Auf {topic} ist nichts gekommen.", "Fold": "Zuklappen", "hardware: ": "Hardware: ",
  // panels
  "Edit": "Bearbeiten", "Choose a kind of panel, and the field of a topic that it shows or sets.": "Eine Art von Anzeige wählen, und das Feld eines Topics, das sie zeigt oder setzt.", "Kind of panel": "Art der Anzeige",
  "Field of a topic, or service": "Feld eines Topics, oder Service", "/topic/field or /service": "/topic/feld oder /service", "unit": "Einheit", "on from": "an ab", "color": "Farbe", "least": "kleinster", "most": "größter",
  "step": "Schritt", "value when on": "Wert für an", "value when off": "Wert für aus", "value when released": "Wert beim Loslassen", "the topic's type": "der Typ des Topics",
  "Type a topic and a field, as /button_state/data.": "Topic und Feld eingeben, wie /button_state/data.", "Change": "Ändern", "Add": "Hinzufügen", "Move to the left": "Nach links", "Move to the right": "Nach rechts",
  "Change this panel": "Anzeige ändern", "Remove this panel": "Anzeige entfernen", "{name} has no such field": "{name} hat kein solches Feld", "nobody publishes {name}: choose its type": "niemand sendet {name}: seinen Typ wählen",
  "there is no service {name}": "es gibt keinen Service {name}", "Value": "Wert", "Lamp": "Lampe", "Gauge": "Zeiger", "Switch": "Schalter", "Slider": "Regler", "Button": "Taster",
  // publish, services, parameters
  "Publish once": "Einmal senden", "Repeat": "Wiederholen", "Times a second": "Mal pro Sekunde", "times a second": "mal pro Sekunde",
  "Choose a topic that is published: its type becomes a form.": "Ein Topic wählen, das gesendet wird: sein Typ wird ein Formular.",
  "This token is read-only: it publishes nothing.": "Dieses Token darf nur lesen: es sendet nichts.", "{count} published": "{count} gesendet", "It has no fields.": "Es hat keine Felder.",
  "Call": "Aufrufen", "choose one of {count} services": "einen von {count} Services wählen", "no services": "keine Services", "Choose a service: its request becomes a form.": "Einen Service wählen: seine Anfrage wird ein Formular.",
  "This token is read-only: it calls no services.": "Dieses Token darf nur lesen: es ruft keine Services auf.", "waiting for the answer …": "wartet auf die Antwort …",
  "done: the answer has no fields": "fertig: die Antwort hat keine Felder", "Filter names and values": "Namen und Werte filtern", "Name of a new parameter": "Name eines neuen Parameters", "/name": "/name",
  "value, as 5 or [1, 2] or text": "Wert, wie 5 oder [1, 2] oder Text", "Its value": "Sein Wert", "Set": "Setzen", "Value of {name}": "Wert von {name}", "Delete {name}": "{name} löschen", "delete": "löschen",
  "{count} of {all} parameters": "{count} von {all} Parametern",
};
