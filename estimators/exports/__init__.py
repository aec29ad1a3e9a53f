"""Files of logs for maps and for programs of other fields: KML, GPX, GeoJSON."""
