# Sourced: `locked NAME` prints what requirements/environment.txt says of one package, with its hashes.

locked() {
    awk -v name="$1==" 'index($0, name) == 1 { on = 1 } on { print; if (!/\\$/) exit }' \
        requirements/environment.txt
}
