use super::*;

fn table(text: &str) -> Result<Table, String> {
    read(text.as_bytes()).map_err(|error| error.to_string())
}

/// Ways of all pulses of a table, `+` and `-`, a blank between rows.
fn ways(text: &str) -> String {
    let row = |row: &PulseRow| {
        let ways = row.pulses.iter().map(|pulse| if pulse.rises { '+' } else { '-' });
        ways.collect::<String>()
    };
    table(text).unwrap().rows.iter().map(row).collect::<Vec<_>>().join(" ")
}

#[test]
fn columns_are_known_by_many_names() {
    for header in [
        "device,pulse,polarity,conductance",
        "Device ID,Pulse number,Direction,Conductance (uS)",
        "cell;n;sign;G [nS]",
        "\"sample\"\tindex\tType\tconductance_microsiemens",
        "id,Pulse No.,phase,I_nA",
    ] {
        let separator = header.chars().find(|c| ",;\t".contains(*c)).unwrap();
        let lines = "a,1,up,1.5\na,2,up,2\na,3,down,1\nb,1,up,3\nb,2,dep,1";
        let text = format!("{header}\n{}", lines.replace(',', &separator.to_string()));
        let found = table(&text).unwrap_or_else(|error| panic!("{header}: {error}"));
        assert_eq!((found.devices.len(), found.reads, found.said.len()), (2, 5, 0), "{header}");
        assert_eq!(found.ends, [[1.0, 2.0], [1.0, 3.0]]);
        let to: Vec<_> = found.rows[0].pulses.iter().map(|pulse| (pulse.rises, pulse.to)).collect();
        assert_eq!((found.rows[0].start, &to[..]), (1.5, &[(true, 2.0), (false, 1.0)][..]));
    }
}

#[test]
fn polarities_have_many_words() {
    for (up, down) in [
        ("up", "down"),
        ("Potentiation", "DEPRESSION"),
        ("set", "reset"),
        ("+", "-"),
        ("1", "-1"),
        ("ltp", "LTD"),
    ] {
        let text =
            format!("pulse,g,polarity\n0,1,{up}\n1,2,{up}\n2,3,{up}\n3,2,{down}\n4,1,{down}\n");
        assert_eq!(ways(&text), "++--", "{up}");
    }
    // a read without a pulse begins a row
    assert_eq!(ways("g,polarity\n1,\n2,up\n1.5,\n1,down\n2,up\n"), "+ -+");
}

#[test]
fn without_polarities_a_turn_of_the_conductance_tells_them() {
    // small steps back are noise, large ones are turns
    let text = "pulse,conductance\n0,1\n1,3\n2,2.8\n3,5\n4,7\n5,6.9\n6,9\n7,6\n8,6.5\n9,3\n10,1\n11,4\n12,8\n";
    assert_eq!(ways(text), "++++++----++");
    assert_eq!(ways("pulse,conductance\n0,9\n1,6\n2,3\n3,1\n4,1.5\n5,5\n6,9\n"), "---+++");
    // pulses counted anew: the way changes, so the row goes on; the same way again is another row
    let text = "pulse,conductance\n1,1\n2,4\n3,9\n1,8\n2,4\n3,1\n";
    assert_eq!(ways(text), "++---");
    let text = "pulse,conductance\n1,1\n2,4\n3,9\n1,1\n2,4\n3,9\n1,6\n2,2\n";
    assert_eq!(ways(text), "++ ++--");
    let found = table(text).unwrap();
    assert!(found.said[0].contains("where the conductance turns"), "{:?}", found.said);
}

#[test]
fn pulses_between_reads_are_counted() {
    let text = "pulse,g,polarity\n0,1,up\n10,2,up\n20,3,up\n10,2,down\n30,1,down\n";
    let found = table(text).unwrap();
    let counts: Vec<_> = found.rows[0].pulses.iter().map(|pulse| pulse.count).collect();
    assert_eq!(counts, [10, 10, 10, 20]);
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    for (text, wanted) in [
        ("", "holds no reads"),
        ("pulse,g\n", "holds no reads"),
        ("1,2\n2,3\n", "line 1 holds numbers (1, 2) and no names"),
        ("pulse,conductence\n1,2\n", "line 1 names no conductance, only `pulse`, `conductence`"),
        ("pulse,conductence\n1,2\n", "did you mean \"conductance\"?"),
        ("g,conductance\n1,2\n", "two columns for a conductance, `g` and `conductance`"),
        ("pulse,g\n1,2\n2\n", "line 3 has 1 fields, but line 1 names 2 columns"),
        (
            "pulse,g\n1,2\n2,high\n",
            "line 3, column 1 (`g`) holds `high`; a conductance is a number, 0 or more",
        ),
        ("pulse,g\n1,2\n2,-3\n", "holds `-3`"),
        ("pulse,g\n1,2\n2,nan\n", "holds `nan`"),
        ("pulse,g\n1.5,2\n", "line 2, column 0 (`pulse`) holds `1.5`; a pulse has a whole number"),
        (
            "g,polarity\n1,up\n2,sideways\n",
            "line 3, column 1 (`polarity`) holds `sideways`; a polarity is up or down",
        ),
        ("g,device\n1,a\n2,a\n1,b\n1,b\n", "device `b` has the same conductance in every line, 1"),
        ("pulse,g\n1,2\n90000000,3\n", "line 3 lies 89999999 pulses behind"),
        ("PK\x03\x04", "spreadsheet"),
    ] {
        let error = table(text).unwrap_err();
        assert!(error.contains(wanted), "{text:?}: {error}");
    }
}
