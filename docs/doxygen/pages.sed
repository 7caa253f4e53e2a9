# Doxygen's view of a page: links to headers go to what it says of them; of links to what the site has not, the text stays.
s|\]\((\.\./)*include/(wfpg/[^)]*)\)|](@ref \2)|g
s#\[([^]]*)\]\((\.\./)*(bench/results|cmake|tests)[^)]*\)#\1#g
